"""A line that a motor turns: static torques by the ratios, mesh frequencies, power, and what a
missing tooth does.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from closeness import assert_close
from line_tools import IMPLICIT
from refusals import refused

from gensig import load_system
from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.time.newmark import LineSolver, integrate_line
from gensig.errors import StepError
from gensig.faults.registry import read_faults
from gensig.plan.request import read_request
from gensig.systems.run import Run, Start

RPM = np.pi / 30.0
SPEED = 1746.0 * RPM
TORQUE = 60.0
SOLVER = LineSolver(
    sampling_rate=10240.0,
    oversampling=12,
    max_energy_residual=1e-3,
)
MOTOR = (
    "system=two_stage_gearbox",
    "excitation=motor_and_load",
)
RECORDS = (
    "experiment=two_stage",
    "operating.duration_s=0.2",
    "sensing.snr_db=null",
    *IMPLICIT,
)
TEETH = {"3/4": (32, 96), "5/6": (48, 80)}
RATIO = {
    "3/4": 1.0,
    "5/6": 1.0 / 3.0,
}  # of the driving gear's speed to the motor's
RIPPLE = "excitation.motor.torque_ripple={share: 0.1, order: 6}"
FAN = "excitation.loads={fan: {node: 4, law: quadratic, torque_nm: 9}}"


@lru_cache(maxsize=8)
def driven(*words):
    return read_engine_line(read_request([*MOTOR, *words]).config)


def machine(*words):
    return load_system(*RECORDS, *words)


def simulated(record, *faults, start=None):
    return record.simulate(
        tuple(one for fault in faults for one in read_faults(fault)),
        start=start,
    )


def missing(gear, tooth=5):
    return {
        "kind": "missing_tooth",
        "gear": gear,
        "tooth": tooth,
    }


def test_an_even_line_has_the_static_torques_of_its_ratios():
    line = driven()
    response = line.response(SPEED, TORQUE)
    _, elements = line.linear()
    force, amplitudes = response.element_forces(elements)
    for place, name in enumerate(line.mesh_names):
        radius = line.drive.pairs[place].pinion.base_radius
        assert_close(force[place] * radius, TORQUE / RATIO[name], 1e-9)

    assert np.abs(amplitudes).max() < 1e-9 * force.max()
    assert response.fluctuation().max() < 1e-9


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_power_in_is_power_out_and_losses(share):
    line = driven(FAN)
    speed = share * SPEED
    numbers = list(line.drive.numbers)
    mean = line.torques(speed, TORQUE).on(line.drive.numbers).mean(axis=1)

    def power(node):
        return mean[numbers.index(node)] * line.ratios[node] * speed

    assert_close(power(8), -TORQUE * speed, 1e-12)
    assert_close(power(4), -9.0 * share**2 * speed / 3.0, 1e-12)
    assert_close(power(1), -power(8) - power(4), 1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.08])
def test_in_time_the_mean_forces_stay_and_the_energies_balance(friction):
    """With friction a mesh also carries what the meshes behind it lose, under a hundredth each."""
    record = machine("operating.duration_s=1", f"mesh.friction_coefficient={friction}")
    line = record.line(Run(system=record))
    channels = [
        ("mesh_force", 0),
        ("mesh_force", 1),
        ("speed", line.dof(1)),
        ("speed", line.dof(8)),
    ]
    motion = line.run(SOLVER, duration=1.0, channels=channels, settling=0.3)
    for place, name in enumerate(line.machine.mesh_names):
        force = motion.signals["mesh_force", place]
        radius = line.machine.drive.pairs[place].pinion.base_radius
        carried = force.mean() * radius / (TORQUE / RATIO[name]) - 1.0
        if friction == 0.0:
            assert abs(carried) < 1e-4
        else:
            assert 1e-3 < carried < 0.02

    assert np.abs(motion.signals["speed", line.dof(8)]).max() < 0.01 * SPEED / 5.0
    assert not motion.contact_loss.any()  # it does not rattle
    assert motion.energy_residual < 1e-3


@pytest.mark.parametrize("speed_rpm", [900.0, 1500.0])
def test_energies_balance_where_steps_meet_every_pitch_at_the_same_places(speed_rpm):
    """Steps in a pitch: 256 and 153.6, of 512 cells each; an even line rests on such a
    speed.
    """
    record = machine(
        "operating.duration_s=0.3",
        f"operating.speed_rpm={speed_rpm}",
    )
    motion = record.line(Run(system=record)).run(
        SOLVER,
        duration=0.3,
        channels=[("mesh_force", 0)],
        settling=0.3,
    )
    assert motion.energy_residual < 3e-4


def test_a_record_whose_steps_are_too_long_is_made_with_half_of_them():
    words = [
        "operating.speed_rpm=2400",
        "operating.duration_s=0.05",
    ]
    short, long = (machine(*words, f"solver.oversampling={steps}") for steps in (8, 4))
    line = long.line(Run(system=long))
    coarse = replace(SOLVER, oversampling=4)
    record = {"duration": 0.05, "channels": [("speed", 0)]}

    with refused("the energy balance misses", StepError):
        integrate_line(
            line.dynamics,
            coarse,
            **record,
        )

    computed = simulated(long)
    assert computed.integration_error < 1e-3
    np.testing.assert_array_equal(computed.acceleration, simulated(short).acceleration)


@pytest.mark.parametrize("name", list(TEETH))
def test_a_missing_tooth_is_evident_once_a_turn_of_its_gear(name):
    """The record less its sound twin is large near the tooth and nowhere else, turn by turn."""
    record = machine(
        "operating.duration_s=1",
        f"system.record_mesh=[{name.replace('/', ',')}]",
    )
    start = Start(tooth_pinion=0, tooth_wheel=0, phase=0.0)
    sound = simulated(record, start=start)
    pitches = record.pair.pinion.n_teeth * sound.shaft_angle / (2.0 * np.pi)
    for gear, n_teeth in zip(("pinion", "wheel"), TEETH[name], strict=True):
        gone = simulated(record, missing(gear), start=start)
        excess = np.square(gone.acceleration[2] - sound.acceleration[2])
        tooth = (np.floor(pitches) % n_teeth).astype(int)
        by_tooth = np.bincount(tooth, excess, minlength=n_teeth)
        assert by_tooth[5:9].sum() > 0.6 * by_tooth.sum()
        peaks = [np.abs(computed.acceleration[2]).max() for computed in (gone, sound)]
        assert peaks[0] ** 2 > 2.0 * peaks[1] ** 2


@pytest.mark.parametrize(
    ("law", "exponent"),
    [("constant", 0), ("linear", 1), ("quadratic", 2)],
)
def test_a_run_up_follows_its_course_and_its_load_the_law(law, exponent):
    record = machine(
        f"excitation.load.law={law}",
        "operating=ramp",
        "operating.speed_profile.first_factor=0.5",
        "operating.speed_rpm=1746",
        "operating.torque_nm=60",
        "operating.duration_s=0.4",
    )
    line = record.line(Run(system=record))
    load = "angle", line.dof(8)
    channels = [load, ("mesh_force", 0)]
    motion = line.run(SOLVER, duration=0.4, channels=channels, settling=0.3)
    speed = motion.nominal_speed
    # the first mesh also speeds up what is behind it
    system = line.dynamics.system
    inertia = system.mass * system.rotation**2
    behind = inertia.sum() - sum(inertia[: line.dof(3) + 1])
    taken = TORQUE * (speed / SPEED) ** exponent
    taken += behind * np.gradient(speed, 1.0 / 10240.0)
    given = motion.signals["mesh_force", 0] * record.pair.pinion.base_radius
    for part in (slice(500, 1500), slice(-1500, -500)):
        assert_close(
            given[part].mean(),
            taken[part].mean(),
            0.01,
        )

    assert np.abs(motion.signals[load]).max() < 0.2


def test_slip_damps_the_rigid_motion_and_ripple_shakes_at_its_order():
    line = driven(RIPPLE)
    slope = line.engine.dampers(line.ratios)
    assert_close(slope[1], 60.0 * 0.97 / (0.03 * SPEED), 1e-12)
    assert_close(
        line.matrices().damping[0, 0] - line.drive.matrices().damping[0, 0],
        slope[1],
        1e-6,
    )

    response = line.response(SPEED, TORQUE)
    lines = np.abs(response.angle[0])
    assert response.orders[int(lines.argmax())] == 6.0
    assert np.sort(lines)[-2] < 1e-9 * lines.max()

    stiff = driven(RIPPLE, "excitation.motor.slip=0.001").response(SPEED, TORQUE)
    assert stiff.fluctuation()[0] < 0.7 * response.fluctuation()[0]
