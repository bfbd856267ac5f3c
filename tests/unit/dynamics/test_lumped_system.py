"""Linear part of the equations of motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.dynamics.system import LumpedSystem, slowest_decay
from gensig.errors import SimulationError


def two_masses(**changes):
    values = {
        "names": ("a", "b"),
        "mass": np.array([1.0, 2.0]),
        "stiffness": np.array([[5.0, -5.0], [-5.0, 5.0]]),
        "damping": np.diag([0.1, 0.0]),
        "force": np.zeros(2),
    }
    return LumpedSystem(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"mass": np.array([1.0, 0.0])}, "mass or inertia of 'b' must be positive"),
        ({"stiffness": np.array([[5.0, -5.0], [0.0, 5.0]])}, "stiffness matrix is not symmetric"),
        ({"damping": np.array([[0.0, 1.0], [-1.0, 0.0]])}, "damping matrix is not symmetric"),
        ({"damping": np.diag([-1.0, 0.0])}, "damping matrix would feed energy in"),
        ({"stiffness": np.diag([1.0, -1.0])}, "stiffness matrix would feed energy in"),
    ],
)
def test_systems_that_cannot_be(changes, text):
    with pytest.raises(SimulationError, match=text):
        two_masses(**changes)


def test_a_group_holds_the_matrices_of_each_machine(machine, dynamics_of):
    """Also where a machine lacks an entry that its neighbour has; an empty lane repeats the first."""
    soft = {"gear.pinion.support.stiffness_x_n_per_m": 0.0, "gear.wheel.support.damping_y_ns_per_m": 0.0}
    stiff = {"gear.pinion.support.stiffness_x_n_per_m": 9e5, "operating.torque_nm": 31.0}
    machines = [dynamics_of(machine(changes)) for changes in (soft, {}, stiff)]
    group, n = pack(machines, 1e-6), 6
    for lane, dynamics in enumerate([*machines, machines[0]]):
        system = dynamics.system()
        for matrix, part in ((system.stiffness, "stiffness"), (system.damping, "damping")):
            rebuilt = np.zeros((n, n))
            rebuilt[getattr(group, f"{part}_row"), getattr(group, f"{part}_column")] = getattr(group, f"{part}_value")[
                lane::LANES
            ]
            assert_allclose(rebuilt, matrix, rtol=0, atol=0)
        assert_allclose(group.inverse_mass[lane::LANES], 1 / system.mass, rtol=1e-15, atol=0)
        assert_allclose(group.force[lane::LANES], system.force, rtol=0, atol=0)


def test_slowest_decay_of_an_oscillator():
    system = LumpedSystem(
        names=("a",), mass=np.array([2.0]), stiffness=np.eye(1) * 50, damping=np.eye(1) * 4, force=np.zeros(1)
    )
    assert_allclose(slowest_decay(system, np.zeros(1), 0.0), 1.0, rtol=1e-9, atol=0)
    free = replace(system, stiffness=np.zeros((1, 1)), damping=np.zeros((1, 1)))
    assert np.isinf(slowest_decay(free, np.zeros(1), 0.0))


class TestPairModes:
    @pytest.fixture
    def modes(self, xiamen, dynamics_of):
        """Undamped frequencies of a pair with its mesh held, Hz, sorted; with and without the drive's spring."""

        def frequencies(mesh_stiffness, drive=True):
            dynamics = dynamics_of(xiamen)
            system, direction = dynamics.system(), dynamics.approach_direction()
            k = system.stiffness + mesh_stiffness * np.outer(direction, direction)
            if not drive:
                k[2, 2] -= system.stiffness[2, 2]
            root = np.sqrt(np.outer(system.mass, system.mass))
            return np.sqrt(np.maximum(np.linalg.eigvalsh(k / root), 0)) / (2 * np.pi)

        return frequencies

    def test_reference_frequencies(self, modes):
        # spur reference (docs/validation.md), section 5.1, mesh 3.28e8 N/m
        found = modes(3.28e8, drive=False)
        assert_allclose(found[1:], [60.8, 178.6, 269.4, 690.2, 11704], rtol=3e-3, atol=0)

    def test_exactly_one_rigid_mode_without_the_drive(self, modes):
        found = modes(3.28e8, drive=False)
        assert (found < 1e-2).sum() == 1
        assert (modes(0.0, drive=False) < 1e-2).sum() == 2

    def test_the_drive_holds_it_at_five_hertz(self, modes, xiamen):
        assert_allclose(modes(3.28e8)[0] * 2 * np.pi, xiamen.operating.drive_frequency * 2 * np.pi, rtol=2e-3, atol=0)
