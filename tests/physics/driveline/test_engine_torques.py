"""The engine's torques on its line: means that balance, orders of even firing, loads, what is
refused.
"""

import numpy as np
import pytest
from closeness import assert_close
from engine_cases import (
    RPM,
    SPEED,
    TORQUE,
    option,
    ratio_of_teeth,
    ratios,
    torques_of,
)
from refusals import given, refused

from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.excitation.engine import read_engine, read_wheels
from gensig.driveline.excitation.engine_torques import engine_torques
from gensig.driveline.linear.forced import cycle_orders
from gensig.errors import ConfigError

NODES = tuple(ratios())
THROWS = range(3, 13)


def changed(path, value):
    values = option()
    *groups, last = path.split(".")
    place = values
    for group in groups:
        place = place[group]
    place[last] = value
    return values


@pytest.mark.parametrize(
    ("rpm", "torque"),
    [
        (650, 0.0),
        (1200, 3000.0),
        (1688, 12680.0),
        (1750, 13600.0),
    ],
)
def test_power_of_the_gas_is_that_of_all_it_drives(rpm, torque):
    computed = torques_of(option(), rpm * RPM, torque)
    ratio = np.array(list(ratio_of_teeth().values()))
    assert (
        abs(np.sum(ratio * computed.on(NODES).mean(axis=1)))
        < 1e-6 * computed.indicated_torque
    )
    assert computed.brake_torque == torque
    assert computed.indicated_torque > torque + 1000.0
    assert_close(
        computed.on(NODES)[16].mean(),
        -torque,
        atol=1e-9,
    )


def test_reference_point_is_that_of_the_class():
    computed = torques_of(option())
    assert_close(computed.pressure.max() * 1e-6, 17.0, 0.01)
    assert_close(
        computed.indicated_torque / 20, 697.0, 0.02
    )  # the independent estimate with the same sizes

    consumption = (
        computed.fuel_volume * 840 * 20 / CYCLE * SPEED / (TORQUE * SPEED)
    )  # kg/J
    assert 0.18 < consumption * 3.6e9 / 1e3 < 0.22  # kg/kWh of a good diesel


def test_harmonics_of_one_cylinder_are_as_estimated_independently():
    values = changed("injection_pump", None)
    values["cylinder"]["reciprocating_mass_kg"] = 0.0
    values["layout"] = {
        "banks": ["A"],
        "bank_angles_deg": [0],
        "throw_angles_deg": [0],
        "firing_order": ["A1"],
    }
    values["throw_nodes"] = [13]
    values["valve_nodes"] = {"A": []}
    values["reference"]["torque_nm"] = TORQUE / 20
    values["loads"] = None
    computed = torques_of(values, torque=TORQUE / 20)
    mean, amplitude = cycle_orders(computed.on(NODES)[12], 20)
    estimated = [
        2.33,
        3.44,
        2.89,
        2.70,
        2.22,
        1.86,
        1.56,
        1.27,
        1.01,
        0.81,
        0.65,
        0.53,
    ]
    gas = computed.indicated_torque

    assert_close(np.abs(amplitude[:12]) / gas, estimated, 0.08)
    assert (
        0.05 < abs(amplitude[19]) / gas < 0.15
    )  # 0.08 estimated: the steepness of combustion decides it
    assert mean > 0.0


def test_even_firing_leaves_only_multiples_of_the_tenth_order_of_all_cylinders():
    throws = torques_of(option()).on(NODES)[list(THROWS)]
    _, together = cycle_orders(throws.sum(axis=0), 80)
    _, alone = cycle_orders(throws[0], 80)
    others = np.arange(1, 81) % 20 != 0

    assert np.abs(together[others]).max() < 1e-6 * np.abs(together).max()
    assert np.abs(together[19]) > 100.0
    assert np.abs(alone[others]).max() > 1000.0  # of one throw all half orders


def test_uneven_firing_has_other_orders():
    values = option()
    values["layout"]["bank_angles_deg"] = [0, 90]
    throws = torques_of(values).on(NODES)[list(THROWS)]
    _, together = cycle_orders(throws.sum(axis=0), 80)

    assert (
        np.abs(together[4]) > 1000.0
    )  # order 2.5: the bank's own, no longer cancelled


def test_pump_pulses_follow_the_firing_and_the_load():
    full, half = (
        torques_of(option(), torque=share * TORQUE).on(NODES)[45:65].sum(axis=0)
        for share in (1.0, 0.5)
    )
    _, orders = cycle_orders(full, 80)
    others = np.arange(1, 81) % 20 != 0

    assert np.abs(orders[others]).max() < 1e-6 * np.abs(orders).max()
    assert full.mean() < 1.5 * half.mean() < 0.0


def test_quadratic_loads_follow_the_speed_and_constant_ones_do_not():
    slow, fast = (
        torques_of(option(), rpm * RPM, 0.0).on(NODES).mean(axis=1)
        for rpm in (800, 1600)
    )
    assert_close(fast[42], 4.0 * slow[42], 1e-12)
    assert_close(fast[66], slow[66], 1e-12)


def test_a_disturbance_of_the_dynamometer_is_given_apart():
    values = changed("dynamometer.disturbance_share", 0.05)
    computed = torques_of(values)
    assert computed.disturbance_node == 17
    assert_close(computed.disturbance_torque, 0.05 * TORQUE, 1e-7)
    assert_close(computed.disturbance_frequency, 5.0, 1e-7)
    assert_close(computed.on(NODES), torques_of(option()).on(NODES))


def pressure_file(folder, scale=1.0):
    computed = torques_of(option())
    path = folder / "measured.csv"
    table = np.column_stack(
        [
            np.degrees(computed.angle),
            scale * computed.pressure * 1e-6,
        ]
    )
    header = "crank_angle_deg,pressure_mpa"
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    return changed("pressure.file", str(path)), computed


def test_a_measured_pressure_gives_the_torque_back(tmp_path):
    values, burned = pressure_file(tmp_path)
    computed = torques_of(values, torque=None)
    assert_close(computed.brake_torque, TORQUE, 1e-4)
    assert_close(computed.on(NODES), burned.on(NODES), atol=1.0)


def test_torques_that_contradict_the_pressure_are_refused(tmp_path):
    measured, _ = pressure_file(tmp_path)
    (tmp_path / "weak").mkdir()
    weak, _ = pressure_file(tmp_path / "weak", scale=0.02)
    idle = changed("friction_mean_pressure_mpa", 0.0)
    idle.update(loads=None, injection_pump=None, valves=None)
    for values, torque, message in (
        (
            weak,
            None,
            r"gives 281 N m, below the .* N m of friction and drives",
        ),
        (
            measured,
            100.0,
            "which decides it; leave the torque out",
        ),
        (
            option(),
            None,
            "a Wiebe cycle needs the brake torque",
        ),
        (
            option(),
            -10.0,
            r"the brake torque -10 N m is below the friction",
        ),
        (
            idle,
            0.0,
            r"the torque of the gas, 0 N m with .* drives, is below the 2.4",
        ),
    ):
        with pytest.raises(ConfigError, match=message):
            torques_of(values, torque=torque)


REFUSED = {
    "throw_nodes=[13,12]": "excitation.throw_nodes has 2 different nodes for 10 throws",
    "throw_nodes=[13,13,11,10,9,8,7,6,5,4]": (
        "excitation.throw_nodes has 9 different nodes for 10 throws"
    ),
    "throw_nodes=[99,12,11,10,9,8,7,6,5,4]": (
        "excitation.throw_nodes: the shaft line has no node 99"
    ),
    "throw_nodes=[20,12,11,10,9,8,7,6,5,4]": (
        "node 20 turns 0.5 times as fast as the crank; it needs 1"
    ),
    "throw_nodes=[1.5]": "excitation.throw_nodes = [1.5] is not a list of whole numbers",
    "valve_nodes.A=[1,2]": "excitation.valve_nodes.A has 2 nodes for 10 throws",
    "valve_nodes.A=[67,67,67,67,67,67,67,67,67,67]": (
        "node 67 turns 1.475 times as fast as the crank; it needs 0.5"
    ),
    "valve_nodes.C=[]": "excitation.valve_nodes: no bank 'C'; there are A, B",
    "valves.intake.cam.lift_mm=0": "excitation.valves.intake.cam.lift_mm = 0 must be positive",
    "valves.intake.cam=3": "excitation.valves.intake.cam = 3 must be a group of keys",
    "valves.intake.open_deg=3": (
        "excitation.valves.intake: unknown key 'open_deg'; did you mean 'opening_deg'?"
    ),
    'injection_pump.cylinders=["A1"]': (
        "excitation.injection_pump.cylinders must name a different cylinder"
    ),
    "injection_pump.nodes='46'": (
        "excitation.injection_pump.nodes = '46' is not a list of whole numbers"
    ),
    "injection_pump.cam.follower=1": "excitation.injection_pump.cam.follower = 1 is not text",
    "injection_pump.diameter_cm=1": "unknown key 'diameter_cm'; did you mean 'diameter_mm'?",
    "loads.fresh_water_pump.node=99": (
        "excitation.loads.fresh_water_pump.node: the shaft line has no node 99"
    ),
    "loads.fresh_water_pump.law='cubic'": (
        "excitation.loads.fresh_water_pump.law = 'cubic'; allowed: constant"
    ),
    "loads.fresh_water_pump.torque_nm=-1": (
        "excitation.loads.fresh_water_pump.torque_nm = -1 must not be"
    ),
    "dynamometer.node=99": "excitation.dynamometer.node: the shaft line has no node 99",
    "dynamometer.disturbance_share=2": (
        "excitation.dynamometer.disturbance_share = 2 must lie in 0..1"
    ),
    "dynamometer.disturbance_frequency_hz=0": "disturbance_frequency_hz = 0 must be positive",
    "reference.speed_rpm=0": "excitation.reference: speed_rpm and torque_nm must be positive",
    "friction_mean_pressure_mpa=-1": (
        "excitation.friction_mean_pressure_mpa = -1 must not be negative"
    ),
    "friction_mean_pressure_mpa='much'": (
        "excitation.friction_mean_pressure_mpa = 'much' is not a number"
    ),
    "pressure.file=3": "excitation.pressure.file = 3 is not text",
    "pressure.kind='otto'": "excitation.pressure: unknown key 'kind'",
    "pressure.boost_pressure=1": (
        "'boost_pressure' has the wrong unit; write it as 'boost_pressure_mpa'"
    ),
    "kind='motor'": "excitation.kind = 'motor'; allowed: engine",
    "sound=1": "excitation: unknown key 'sound'",
    "cylinder.bore_mm='wide'": "excitation.cylinder.bore_mm = 'wide' is not a number",
    "layout.firing_order=[" + "'A1'," * 20 + "]": (
        "excitation.layout.firing_order repeats A1 (places 1 and 2)"
    ),
}


@pytest.mark.parametrize(("change", "message"), REFUSED.items())
def test_impossible_engines_are_refused_in_one_line(change, message):
    ((path, value),) = given(change).items()
    with refused(message):
        torques_of(changed(path, value))


def test_toothed_wheels_are_read_by_name():
    wheels = read_wheels(option())
    nodes = {name: wheel.node for name, wheel in wheels.items()}
    assert nodes == {"flywheel": 14, "pump_end": 45}
    assert read_wheels(option(toothed_wheels=None)) == {}

    without_node = option()
    del without_node["toothed_wheels"]["flywheel"]["node"]
    for values, message in (
        (
            changed("toothed_wheels.flywheel.n_teeth", 2),
            ".n_teeth = 2 must lie in 4..1000",
        ),
        (without_node, ": missing node"),
    ):
        place = "excitation.toothed_wheels.flywheel"
        with refused(place + message):
            read_wheels(values)


def test_missing_keys_are_named():
    values = option()
    del values["loads"]
    with refused("excitation: missing loads"):
        read_engine(values)
    with refused("excitation = 3 must be a group of keys"):
        read_engine(3)


def test_finer_cycles_give_the_same_torques():
    engine = read_engine(option())
    coarse, fine = (
        engine_torques(engine, SPEED, TORQUE, ratio_of_teeth(), n_points=n)
        for n in (2880, 11520)
    )
    _, one = cycle_orders(coarse.on(NODES), 40)
    _, other = cycle_orders(fine.on(NODES), 40)

    assert np.max(np.abs(one - other)) < 2e-3 * np.max(np.abs(other))
