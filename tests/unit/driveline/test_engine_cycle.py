"""One cylinder: kinematics, work of the gas, inertia, the Wiebe cycle's energy, measured
pressures.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import given, refused

from gensig.driveline.excitation.cycle import (
    CYCLE,
    Cylinder,
    cycle_angles,
    delayed,
    gas_torque,
    inertia_torque,
)
from gensig.driveline.excitation.pressure import (
    PressureFile,
    WiebeCycle,
    read_pressure,
    wiebe_parts,
)

CYLINDER = Cylinder(
    bore=0.17,
    stroke=0.195,
    crank_to_rod_ratio=0.257,
    compression_ratio=13.5,
    reciprocating_mass=11.0,
)
CYCLE_OPTION = WiebeCycle(
    boost_pressure=3.2e5,
    exhaust_share=0.8,
    ambient_pressure=1e5,
    exponent=1.35,
    combustion_begin=np.radians(-12),
    combustion_duration=np.radians(65),
    shape=0.7,
    exhaust_opening=np.radians(125),
    blowdown_angle=np.radians(15),
    intake_closing=np.radians(-140),
)
N = 2880
ANGLE = cycle_angles(N)


def derivative(values):
    """Spectral, of values over the cycle, with respect to the crank angle."""
    orders = np.fft.rfftfreq(N, 1.0 / N) * 2.0 * np.pi / CYCLE
    return np.fft.irfft(1j * orders * np.fft.rfft(values), N)


def test_piston_runs_between_the_dead_centers():
    travel = CYLINDER.piston_travel(np.array([0.0, np.pi, 2 * np.pi]))
    assert_allclose(travel, [0.0, 0.195, 0.0], atol=1e-15)
    volume = CYLINDER.volume(np.array([0.0, np.pi]))
    assert_allclose(volume[1] / volume[0], 13.5, rtol=1e-12)


def test_slopes_are_those_of_the_travel():
    rate = CYLINDER.piston_rate(ANGLE)
    assert_allclose(rate, derivative(CYLINDER.piston_travel(ANGLE)), rtol=0, atol=1e-12)
    assert_allclose(
        CYLINDER.piston_curvature(ANGLE), derivative(rate), rtol=0, atol=1e-10
    )


def test_mean_gas_torque_is_the_work_over_four_pi():
    motored, fired = wiebe_parts(CYCLE_OPTION, CYLINDER, N, 1.0)
    pressure = motored + 15e3 * fired
    torque = gas_torque(CYLINDER, ANGLE, pressure, 1e5)
    closed = np.append(pressure, pressure[0])
    volume = CYLINDER.volume(np.append(ANGLE, CYCLE))
    work = np.sum(0.5 * (closed[1:] + closed[:-1]) * np.diff(volume))
    assert_allclose(torque.mean(), work / CYCLE, rtol=1e-3)
    assert torque.mean() > 500.0
    assert_allclose(
        gas_torque(CYLINDER, ANGLE, np.full(N, 3e5), 1e5).mean(), 0.0, atol=1e-9
    )


def test_inertia_torque_does_no_work_and_grows_with_the_speed_squared():
    torque = inertia_torque(CYLINDER, ANGLE, 176.0)
    assert np.ptp(torque) > 1000.0
    assert abs(torque.mean()) < 1e-9 * np.ptp(torque)
    assert_allclose(inertia_torque(CYLINDER, ANGLE, 352.0), 4.0 * torque, rtol=1e-12)


def test_inertia_torque_is_equation_19_without_its_leading_minus():
    speed, ratio = 176.0, 0.257
    series = (
        ratio / 4 * np.sin(ANGLE)
        - np.sin(2 * ANGLE) / 2
        - 3 * ratio / 4 * np.sin(3 * ANGLE)
        - ratio**2 / 4 * np.sin(4 * ANGLE)
    )
    printed_without_minus = 11.0 * 0.0975**2 * speed**2 * series
    torque = inertia_torque(CYLINDER, ANGLE, speed)
    assert_allclose(torque, printed_without_minus, rtol=0, atol=0.02 * np.ptp(torque))
    # past top dead center the piston is pushed downwards by its own mass until the crank slows
    # it: first against
    assert torque[N // 32] < 0.0
    assert np.max(np.abs(torque + printed_without_minus)) > 1.5 * np.max(np.abs(torque))


def test_first_law_holds_while_the_valves_are_shut():
    heat = 15e3
    motored, fired = wiebe_parts(CYCLE_OPTION, CYLINDER, N, 1.0)
    pressure, after = (
        motored + heat * fired,
        np.where(ANGLE >= CYCLE / 2, ANGLE - CYCLE, ANGLE),
    )
    shut = (after >= CYCLE_OPTION.intake_closing) & (
        after <= CYCLE_OPTION.exhaust_opening
    )
    order = np.argsort(after[shut])
    p, v = pressure[shut][order], CYLINDER.volume(after[shut][order])
    work = np.sum(0.5 * (p[1:] + p[:-1]) * np.diff(v))
    stored = (p[-1] * v[-1] - p[0] * v[0]) / (CYCLE_OPTION.exponent - 1.0)
    assert_allclose(work + stored, heat, rtol=1e-3)


def test_without_heat_it_compresses_polytropically():
    motored, _ = wiebe_parts(CYCLE_OPTION, CYLINDER, N, 1.0)
    closing = CYLINDER.volume(np.array([CYCLE_OPTION.intake_closing]))[0]
    top = CYLINDER.volume(np.array([0.0]))[0]
    assert_allclose(motored[0], 3.2e5 * (closing / top) ** 1.35, rtol=1e-12)
    assert_allclose(
        motored[N * 500 // 720], 3.2e5, rtol=1e-12
    )  # 500 degrees: intake open


def test_boost_follows_the_power():
    assert CYCLE_OPTION.gas_exchange(0.0) == (1e5, 1e5)
    assert_allclose(CYCLE_OPTION.gas_exchange(1.0), (3.2e5, 1e5 + 0.8 * 2.2e5))
    assert CYCLE_OPTION.gas_exchange(0.5)[0] < CYCLE_OPTION.gas_exchange(0.9)[0]


def test_a_delay_of_whole_points_moves_and_changes_nothing():
    torque = np.random.default_rng(0).standard_normal(N)
    assert_allclose(delayed(torque, CYCLE / 20), np.roll(torque, N // 20), atol=1e-9)
    assert_allclose(delayed(torque, 0.0), torque, atol=0)


@pytest.mark.parametrize(
    ("change", "message"),
    {
        "bore=0.0": "bore_mm = 0 must be positive",
        "stroke=-0.1": "stroke_mm = -100 must be positive",
        "crank_to_rod_ratio=1.0": "crank_to_rod_ratio = 1 must lie between 0 and 1",
        "compression_ratio=1.0": "compression_ratio = 1 must be above 1",
        "reciprocating_mass=-1.0": "reciprocating_mass_kg = -1 must not be negative",
    }.items(),
)
def test_cylinders_that_cannot_be_are_refused(change, message):
    with refused(message):
        replace(CYLINDER, **given(change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"boost_pressure": 5e4},
            "0 < ambient_pressure_mpa <= boost_pressure_mpa is needed, not 0.1, 0.05",
        ),
        ({"exponent": 1.0}, "exponent = 1 must lie in 1.1..1.67"),
        (
            {"combustion_duration": np.radians(150)},
            "combustion ends 138 degrees after top dead center",
        ),
        (
            {"intake_closing": np.radians(-80)},
            "intake_closing_deg = -80 must lie in -180..-90",
        ),
        ({"shape": float("nan")}, "shape = nan must lie in"),
    ],
)
def test_cycles_that_cannot_be_are_refused(change, message):
    with refused(message):
        replace(CYCLE_OPTION, **change)


def write(folder, header, angle, pressure):
    path = folder / "pressure.csv"
    table = np.column_stack([angle, pressure])
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    return PressureFile(file=str(path))


HEADER = "crank_angle_deg,pressure_mpa"
DEGREES = np.arange(-360.0, 360.0, 1.0)
MEGAPASCAL = 2.0 + np.cos(np.radians(DEGREES / 2.0))


@pytest.mark.parametrize(
    ("header", "angle", "pressure"),
    [
        (HEADER, DEGREES, MEGAPASCAL),
        ("pressure_gpa,crank_angle_rad", MEGAPASCAL * 1e-3, np.radians(DEGREES)),
        (HEADER, np.append(DEGREES, 360.0), np.append(MEGAPASCAL, 1.0)),
    ],
)
def test_a_measured_pressure_is_read_whatever_its_units_and_start(
    tmp_path, header, angle, pressure
):
    computed = read_pressure(write(tmp_path, header, angle, pressure), N)
    assert_allclose(computed, 1e6 * (2.0 + np.cos(ANGLE / 2.0)), rtol=1e-4)


@pytest.mark.parametrize(
    ("header", "angle", "pressure", "message"),
    [
        (
            "crank_angle_deg,pressure",
            DEGREES,
            MEGAPASCAL,
            "column pressure has no unit that fits; write pressure_mpa",
        ),
        (
            "crank_angle,pressure_mpa",
            DEGREES,
            MEGAPASCAL,
            "column crank_angle has no unit that fits",
        ),
        (
            "crank_angle_mm,pressure_mpa",
            DEGREES,
            MEGAPASCAL,
            "column crank_angle_mm has no unit that fits",
        ),
        ("angle_deg,pressure_mpa", DEGREES, MEGAPASCAL, "no column crank_angle"),
        (
            "crank_angle_deg,pressure_mpa",
            DEGREES[::-1],
            MEGAPASCAL,
            "row 3, crank_angle must rise",
        ),
        (
            "crank_angle_deg,pressure_mpa",
            DEGREES[:600],
            MEGAPASCAL[:600],
            "121 degrees without a point after row 601",
        ),
        (
            "crank_angle_deg,pressure_mpa",
            2 * DEGREES,
            MEGAPASCAL,
            "runs over 1438 degrees, at most 720",
        ),
        (
            "crank_angle_deg,pressure_mpa",
            DEGREES,
            MEGAPASCAL - 2.0,
            "pressure is absolute and positive",
        ),
        (
            "crank_angle_deg,pressure_mpa",
            DEGREES[:50],
            MEGAPASCAL[:50],
            "too short: 50 rows",
        ),
    ],
)
def test_measured_pressures_that_make_no_cycle_are_refused(
    tmp_path, header, angle, pressure, message
):
    with refused(message) as caught:
        read_pressure(write(tmp_path, header, angle, pressure), N)
    assert str(caught.value).startswith("excitation.pressure.file = ")
