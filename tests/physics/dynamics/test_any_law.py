"""Two evaluations of any mesh law a step: the motions are those of the classical scheme."""

import math

import numpy as np
import pytest
from fault_cases import one
from stacked_motions import exact_motions, integrate

from gensig.dynamics.backends.nystroem import machine_lanes
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import Solver
from gensig.faults.broken import MissingTooth
from gensig.plan.request import read_request
from gensig.systems.pair_machine import running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run

RATE = 51200.0
RECORD = {"sampling_rate": RATE, "duration": 0.04}
PLANE = ("pinion_y", "wheel_x", "wheel_y", "pinion_rotation")
AXIAL = (*PLANE, "pinion_z", "wheel_tilt_x")
SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
MISSING = (MissingTooth(gear="pinion", tooth=3),)
FINE = 64
# one well-damped drive: a short settling
QUICK = {
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
MORE_DAMPED = {"mesh.damping_ratio": 0.0735}  # by a twentieth
PAPER = {
    "mesh.law": "paper",
    "mesh.pair_coupling": "sum",
    "mesh.contact": "linear",
}


def motions(machines, oversampling, channels=PLANE, precision="float64"):
    """Motions of machines by the default method, with the forces of their teeth."""
    solver = Solver(oversampling=oversampling, precision=precision)
    return integrate(
        machines, solver, channels=channels, with_mesh_state=True, **RECORD
    )


def reference(machines, oversampling, channels=PLANE):
    """The same by the classical scheme."""
    return exact_motions(
        machines, oversampling, channels=channels, with_mesh_state=True, **RECORD
    )


def error(found, exact):
    """Largest error of the spectra of the first machine's channels."""
    return in_band_error(found.acceleration, exact.acceleration, RATE)


class TestSpurPairsOfAnyContactRatio:
    """Pairs of which more than three may touch; here those of which fewer do."""

    @pytest.fixture(scope="class")
    @classmethod
    def pairs(cls, machine, dynamics_of):
        errors = np.random.default_rng(8).normal(0, 2e-6, (2, 84))
        teeth = {"pinion_error": errors[0, :23], "wheel_error": errors[1]}
        slow = machine({**QUICK, SPEED: 1200})
        return [
            dynamics_of(machine(QUICK), (one("crack", tooth=4),)),
            dynamics_of(slow, MISSING, **teeth),
        ]

    @pytest.mark.parametrize("precision", ["float64", "float32"])
    def test_motions(self, machine, dynamics_of, pairs, precision, monkeypatch):
        monkeypatch.setattr(machine_lanes, "MOST_CONTACT_RATIO", 0.0)
        exact = reference(pairs, FINE)
        found = motions(pairs, 5, precision=precision)
        assert error(found, exact).max() < 1e-3
        assert np.abs(found.angle - exact.angle).max() < 1e-5
        other = dynamics_of(machine({**QUICK, **MORE_DAMPED}))
        shown = motions([other], 5, precision=precision)
        assert in_band_error(shown.acceleration, exact.acceleration[:1], RATE)[0] > 5e-3

    def test_they_are_followed_by_that_core(self, pairs, monkeypatch):
        three = motions(pairs, 8)
        monkeypatch.setattr(machine_lanes, "MOST_CONTACT_RATIO", 0.0)
        more = motions(pairs, 8)
        assert three.acceleration.tobytes() != more.acceleration.tobytes()
        assert error(more, three).max() < 1e-3


class TestHelicalPairs:
    @pytest.fixture(scope="class")
    @classmethod
    def pairs(cls):
        made = []
        for speed, torque, faults in ((1500, 60, ()), (3000, 160, MISSING)):
            words = [
                f"{SPEED}={speed}",
                f"{TORQUE}={torque}",
                "operating.drive_frequency_hz=20",
            ]
            config = read_request(["experiment=helical", *words]).config
            made.append(
                running_pair(Run(system=read_system(config), faults=faults)).dynamics
            )
        return made

    @pytest.fixture(scope="class")
    @classmethod
    def exact(cls, pairs):
        return reference(pairs, FINE, AXIAL)

    def test_motions(self, pairs, exact):
        found = motions(pairs, 6, AXIAL)
        assert error(found, exact).max() < 1e-3
        assert error(found, motions(pairs[::-1], 6, AXIAL)).min() > 0.1

    def test_the_error_falls_with_the_step(self, pairs):
        """With its cube: what a change of chords within a step makes is corrected.

        The classical scheme does not correct it and has the error of the step's square, so the
        finest of two evaluations is the reference here.
        """
        finest = motions(pairs, FINE, AXIAL)
        coarse, fine = (
            error(motions(pairs, steps, AXIAL), finest).max() for steps in (6, 12)
        )
        assert math.log2(coarse / fine) > 2.5

    def test_loads_of_the_teeth(self, pairs, exact):
        found = motions(pairs, 20, AXIAL)
        for machine, seen, other in zip(pairs, found.seen, exact.seen, strict=True):
            same = seen[0] == other[0]  # a pair enters a sample earlier or later
            assert same.mean() > 0.98
            off = np.abs(seen[1:] - other[1:])[:, same] / machine.reference_force[0]
            assert np.sqrt((off**2).mean()) < 2e-3
            assert np.abs(other[1:]).max() > 0.3 * machine.reference_force[0]


class TestPapersLaw:
    """A pair is switched over one step of the integration, so both schemes take the same."""

    @pytest.fixture(scope="class")
    @classmethod
    def pairs(cls, machine, dynamics_of):
        return [
            dynamics_of(machine({**QUICK, **PAPER, SPEED: speed}), faults)
            for speed, faults in ((1800, ()), (4000, (one("crack", tooth=4),)))
        ]

    def test_motions(self, machine, dynamics_of, pairs):
        found, exact = motions(pairs, 32), reference(pairs, 32)
        assert error(found, exact).max() < 1e-3
        other = dynamics_of(machine({**QUICK, **PAPER, **MORE_DAMPED}))
        shown = motions([other], 32)
        assert in_band_error(shown.acceleration, exact.acceleration[:1], RATE)[0] > 5e-3

    def test_with_the_phase_prescribed_the_motion_is_proportional_to_the_torque(
        self, machine, dynamics_of
    ):
        """The equations are linear then; by the own rotation they are not."""
        found = {}
        for phase in ("prescribed", "rotation"):
            words = {**QUICK, **PAPER, "mesh.phase": phase}
            pairs = [
                dynamics_of(machine({**words, TORQUE: torque}), MISSING)
                for torque in (5, 40)
            ]
            found[phase] = motions(pairs, 16).acceleration
        small, large = found["prescribed"]
        assert np.allclose(large, 8.0 * small, rtol=0.0, atol=1e-6 * large.std())
        small, large = found["rotation"]
        assert np.std(large - 8.0 * small) > 0.1 * large.std()

    def test_the_phase_is_prescribed_as_by_the_classical_scheme(
        self, machine, dynamics_of
    ):
        words = {**QUICK, **PAPER, "mesh.phase": "prescribed"}
        pairs = [dynamics_of(machine(words), MISSING)]
        found, exact = motions(pairs, 32), reference(pairs, 32)
        assert error(found, exact).max() < 2e-3
