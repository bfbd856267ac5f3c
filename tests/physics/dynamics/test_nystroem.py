"""Two evaluations of the mesh law a step: the motions of the classical scheme in fine steps."""

import math

import numpy as np
import pytest
from fault_cases import one
from lane_tools import with_teeth
from stacked_motions import exact_motions, integrate

from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import Solver
from gensig.faults.broken import MissingTooth

RATE = 51200.0
RECORD = {
    "sampling_rate": RATE,
    "duration": 0.05,
    "channels": ("pinion_y", "wheel_x", "wheel_y", "pinion_rotation"),
}
FINE = 32  # steps a sample of the reference
ACCURACY = 1e-3  # of a channel's spectrum at the default step
# one well-damped drive: a short settling
QUICK = {
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
MORE_DAMPED = {"mesh.damping_ratio": 0.0735}  # by a twentieth
MISSING = (MissingTooth(gear="pinion", tooth=3),)
# so many distinct teeth on both gears that the table stores them one by one
PITS = tuple(
    one("pitting", gear=gear, tooth=tooth, pit_width_mm=4.0 + tooth)
    for gear, n_teeth in (("pinion", 5), ("wheel", 6))
    for tooth in range(n_teeth)
)
SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
RAMPS = {
    "operating.speed_profile": [[-0.4, 0.4], [0.4, 1.6]],
    "operating.torque_profile": [[-0.4, 0.6], [0.4, 1.4]],
}
ROTORS = {"system.motor.inertia_kg_m2": 5e-4, "system.load.inertia_kg_m2": 5e-3}
CASES = {
    "sound": ({}, ()),
    "slow": ({SPEED: 600, TORQUE: 60}, ()),
    "fast": ({SPEED: 6000}, ()),
    "crack": ({}, (one("crack", tooth=4),)),
    "missing": ({}, MISSING),
    "bouncing": ({TORQUE: 2}, MISSING),
    "pits": ({}, PITS),
    "ramps": (RAMPS, ()),
    "rotors": (ROTORS, ()),
}


@pytest.fixture(scope="module")
def machines(machine, dynamics_of):
    """A machine of every case, and tooth errors on every second."""
    errors = np.random.default_rng(8).normal(0, 2e-6, (2, 84))
    made = {}
    for k, (name, (changes, faults)) in enumerate(CASES.items()):
        teeth = {"pinion_error": errors[0, :23], "wheel_error": errors[1]}
        system = machine({**QUICK, **changes})
        made[name] = dynamics_of(system, faults, **(teeth if k % 2 else {}))
    return made


def motions(machines, oversampling, precision="float64", **more):
    """Motions of machines by the default method."""
    solver = Solver(oversampling=oversampling, precision=precision)
    return integrate(machines, solver, **{**RECORD, **more})


@pytest.fixture(scope="module")
def pairs(machines):
    """The machines with the degrees of freedom of two gears."""
    return [each for name, each in machines.items() if name != "rotors"]


@pytest.fixture(scope="module")
def exact(pairs):
    return exact_motions(pairs, FINE, with_mesh_state=True, **RECORD)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_motions_are_those_of_the_classical_scheme(
    machine, dynamics_of, pairs, exact, precision
):
    found = motions(pairs, 5, precision)
    error = in_band_error(found.acceleration, exact.acceleration, RATE)
    bounces = exact.contact_loss[:, 0] > 0.01
    assert error[~bounces].max() < ACCURACY
    assert error[bounces].max() < 1.5 * ACCURACY

    other = dynamics_of(machine({**QUICK, **MORE_DAMPED}))
    shown = motions([other], 5, precision).acceleration
    assert in_band_error(shown, exact.acceleration[:1], RATE)[0] > 5.0 * ACCURACY

    assert np.abs(found.angle - exact.angle).max() < 1e-5
    lost = exact.contact_loss[:, 0]
    assert np.abs(found.contact_loss[:, 0] - lost).max() < 1e-3
    assert bounces.any()
    assert np.abs(found.mean_speed / exact.mean_speed - 1.0).max() < 1e-5


def test_motor_and_load_move_too(machines):
    channels = (*RECORD["channels"], "motor_rotation", "load_rotation")
    rotors = [machines["rotors"]]
    found = motions(rotors, 5, channels=channels)
    exact = exact_motions(rotors, FINE, **{**RECORD, "channels": channels})
    error = in_band_error(found.acceleration, exact.acceleration, RATE)
    assert error.max() < ACCURACY


def test_loads_of_the_teeth_are_those_of_the_classical_scheme(pairs, exact):
    """The pair that each row belongs to, and its force, in shares of the mean force."""
    found = motions(pairs, 8, with_mesh_state=True)
    for machine, seen, other in zip(pairs, found.seen, exact.seen, strict=True):
        same = seen[0] == other[0]  # a pair enters a sample earlier or later
        assert same.mean() > 0.99
        off = np.abs(seen[1:] - other[1:])[:, same] / machine.reference_force[0]
        assert np.sqrt((off**2).mean()) < 2e-3


def test_back_flanks_carry(machine, dynamics_of):
    """Light load, little play: the teeth fall back to the other flank."""
    changes = {SPEED: 3000, TORQUE: 0.5, "gear.backlash_um": 10}
    errors = np.random.default_rng(8).normal(0, 3e-6, (2, 84))
    teeth = {"pinion_error": errors[0, :23], "wheel_error": errors[1]}
    machines = [dynamics_of(machine({**QUICK, **changes}), **teeth)]
    found = motions(machines, FINE, with_mesh_state=True).seen[0, 1]
    exact = exact_motions(machines, FINE, with_mesh_state=True, **RECORD).seen[0, 1]
    assert (exact < 0.0).mean() > 0.01
    assert abs((found < 0.0).mean() / (exact < 0.0).mean() - 1.0) < 0.2


def test_the_error_falls_with_the_fourth_power_of_the_step(machine, running_of):
    """Against another machine it does not."""
    sound = running_of(machine(QUICK))
    steps = (4, 16, 64)
    coarse, fine, exact = (motions([sound.dynamics], n).acceleration for n in steps)
    changed = with_teeth(sound, start_phase=sound.teeth.start_phase + 1e-4)
    other = motions([changed.dynamics], 64).acceleration

    def order(reference):
        first, last = (
            in_band_error(each, reference, RATE)[0] for each in (coarse, fine)
        )
        return math.log2(first / last) / 2.0

    assert 3.0 < order(exact) < 4.5
    assert order(other) < 2.0


def test_the_check_shows_the_error(pairs, exact):
    """The beginning at half the step differs from the record by about the record's error."""
    solver = Solver(oversampling=5, precision="float64", max_error=1e-3)
    found = integrate(pairs[:3], solver, **RECORD)
    n_check = found.check.shape[-1]
    checked = in_band_error(found.acceleration[..., :n_check], found.check, RATE)
    error = in_band_error(found.acceleration, exact.acceleration[:3], RATE)
    assert (checked > 0.5 * error).all()
    assert (checked < 3.0 * error).all()
