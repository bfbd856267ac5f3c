"""The running engine in time: what it must share with the linear line, with its gears and with its
sound self.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from closeness import assert_close
from engine_cases import SPEED, TORQUE

from gensig import load_system
from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.running import Governor, running_line, steady_course
from gensig.driveline.time.newmark import LineSolver
from gensig.plan.request import read_request
from gensig.sensing.manufacturing import nominal_gearbox
from gensig.systems.run import Run

GOVERNOR = Governor(frequency=1.0, damping_ratio=0.7)
SOLVER = LineSolver(
    sampling_rate=10240.0,
    oversampling=10,
    max_energy_residual=1e-3,
)
ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
RECORDS = (
    "experiment=engine_broken_tooth",
    "operating.duration_s=0.08",
    "sensing.snr_db=null",
)
CLOSED = (
    "system.backlash_um=0",
    "system.loss_factor.gear_mesh=0",
)


@lru_cache(maxsize=4)
def engine(*words):
    return read_engine_line(read_request([*ENGINE, *words]).config)


def machine(*words):
    return load_system(*RECORDS, *words)


def deviations(line, nodes, settling, duration=0.15):
    channels = [("speed", line.dof(node)) for node in nodes]
    motion = line.run(
        SOLVER,
        duration=duration,
        channels=channels,
        settling=settling,
    )
    at = line.dynamics.vibration.orders * (
        line.dynamics.turned + motion.nominal_angle[:, None]
    )
    linear = [
        np.real(np.exp(1j * at) @ line.dynamics.vibration.speed_deviation[dof])
        for _, dof in channels
    ]
    return (
        motion,
        np.array([motion.signals[channel] for channel in channels]),
        np.array(linear),
    )


def test_an_engine_starts_in_its_vibration_and_a_motor_at_rest():
    for experiment, vibrates in (("engine_test_point", True), ("two_stage", False)):
        system = load_system(f"experiment={experiment}")
        dynamics = system.line(Run(system=system, faults=())).dynamics
        deflection, rate = dynamics.start(0.0)
        assert rate.any() == vibrates
        assert (deflection != dynamics.static_start(0.0)).any() == vibrates


def test_without_play_it_is_the_linear_line():
    """In the limit of small torques, for they are read at the angle of their own shaft, its
    vibration included.

    From the first sample on: it starts in the linear vibration, so that little has to settle.
    """
    whole = running_line(
        engine(*CLOSED),
        steady_course(SPEED, TORQUE),
        governor=GOVERNOR,
        turned=2.0,
    )
    for share, most in ((1.0, 0.15), (0.01, 0.003)):
        dynamics = whole.dynamics
        torques = (replace(t, table=share * t.table) for t in dynamics.torques)
        vibration = replace(
            dynamics.vibration,
            angle=share * dynamics.vibration.angle,
            twist=share * dynamics.vibration.twist,
        )
        weak = replace(dynamics, torques=tuple(torques), vibration=vibration)
        line = replace(whole, dynamics=weak)
        _, computed, exact = deviations(
            line,
            (14, 17, 13),
            settling=0.0,
        )
        for one, other in zip(computed, exact, strict=True):
            assert np.std(one - one.mean() - other) < most * np.std(other)


def test_with_play_its_teeth_part_and_its_energies_balance():
    line = running_line(
        engine(),
        steady_course(SPEED, TORQUE),
        governor=GOVERNOR,
    )
    motion, computed, linear = deviations(line, (14, 45), settling=0.3)
    drive = line.machine.mesh_names.index("21/45")

    assert motion.contact_loss[drive] > 0.1
    assert motion.energy_residual < 1e-3
    assert_close(
        np.std(computed[0]), np.std(linear[0]), 2e-3
    )  # the flywheel hardly feels the gears
    assert np.std(computed[1]) > 1.3 * np.std(
        linear[1]
    )  # a pump gear that is let go does


def test_a_record_is_repeatable_and_turns_with_the_gear_ratio():
    """The driving gear's shaft has half the crank's speed."""
    record = machine()
    computed = record.simulate()
    assert_close(record.operating.speed, 0.5 * SPEED, 1e-6)
    # its drive gives back the friction of the mean force; a mesh that rattles rubs more
    assert_close(computed.mean_speed, 0.5 * SPEED, 1e-3)
    assert np.all(np.diff(computed.shaft_angle) > 0.0)
    assert computed.integration_check == "energy"
    assert computed.integration_error < 1e-3
    np.testing.assert_array_equal(computed.acceleration, record.simulate().acceleration)


def test_a_fine_wheel_without_errors_shows_the_shaft():
    words = [
        f"excitation.toothed_wheels.flywheel.{key}"
        for key in (
            "eccentricity_error_deg=0",
            "tooth_error_deg=0",
        )
    ]
    record = machine(*words, "sensing.channels=[flywheel_speed]")
    line = record.line(Run(system=record))
    motion = line.run(
        SOLVER,
        duration=0.08,
        channels=[("speed", line.dof(14))],
        settling=0.3,
    )
    seen = record.simulate().acceleration[0]
    exact = motion.signals["speed", line.dof(14)]
    inner = slice(20, -20)

    assert np.std(seen[inner] - exact[inner]) < 0.1 * np.std(exact)


def test_supports_of_a_gearbox_reach_the_lateral_line():
    record = machine(
        "system.lateral=true",
        "sensing.channels=[wheel_x, wheel_y]",
    )
    run = Run(system=record)
    nominal = record.line(run)
    stiffer = replace(
        nominal_gearbox(2),
        stiffness_factor=np.array([1.0, 1.0, 2.0, 1.0]),
    )
    scattered = record.line(replace(run, gearbox=stiffer))
    name = record.engine.drive.line.gears[
        record.engine.drive.line.meshes[record.mesh_number].driven
    ].name
    at = nominal.matrices.names.index(f"{name} x")
    ratio = scattered.matrices.stiffness[at, at] / nominal.matrices.stiffness[at, at]

    assert_close(ratio, 2.0, 1e-6)
