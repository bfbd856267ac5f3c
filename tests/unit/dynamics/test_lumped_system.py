"""Linear part of the equations of motion."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from lane_tools import BRIEF, laws, right_hand_side
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
        "rotation": np.zeros(2),
    }
    return LumpedSystem(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"mass": np.array([1.0, 0.0])}, "mass or inertia of 'b' must be positive"),
        (
            {"stiffness": np.array([[5.0, -5.0], [0.0, 5.0]])},
            "stiffness matrix is not symmetric",
        ),
        (
            {"damping": np.array([[0.0, 1.0], [-1.0, 0.0]])},
            "damping matrix is not symmetric",
        ),
        ({"damping": np.diag([-1.0, 0.0])}, "damping matrix would feed energy in"),
        ({"stiffness": np.diag([1.0, -1.0])}, "stiffness matrix would feed energy in"),
    ],
)
def test_systems_that_cannot_be(changes, text):
    with pytest.raises(SimulationError, match=text):
        two_masses(**changes)


def rebuilt(group, part, lane, n):
    """One lane's matrix from its diagonal and what else there is, (dof, dof)."""
    matrix = np.diag(getattr(group, part)[lane::LANES])
    row = np.repeat(np.arange(n), np.diff(group.other_first))
    matrix[row, group.other_column] = getattr(group, f"other_{part}")[lane::LANES]
    return matrix


SOFT = {
    "gear.pinion.support.stiffness_x_n_per_m": 0.0,
    "gear.wheel.support.damping_y_ns_per_m": 0.0,
}
STIFF = {"gear.pinion.support.stiffness_x_n_per_m": 9e5, "operating.torque_nm": 31.0}
ROTORS = {"system.motor.inertia_kg_m2": 2e-3, "system.load.inertia_kg_m2": 5e-2}
LIGHT = {
    **ROTORS,
    "system.motor.coupling_stiffness_nm_per_rad": 500,
    "system.load.coupling_damping_ratio": 0.2,
}


@pytest.mark.parametrize(
    "kinds",
    [(SOFT, {}, STIFF), (ROTORS, LIGHT, {**STIFF, **ROTORS})],
    ids=["pair", "rotors"],
)
def test_a_group_holds_the_matrices_of_each_machine(machine, dynamics_of, kinds):
    """Also where a machine lacks an entry that its neighbour has; an empty lane repeats the first."""
    machines = [dynamics_of(machine(changes)) for changes in kinds]
    group, n = pack(machines, 1e-6), len(machines[0].dofs)
    assert len(group.other_column) == (0 if n == 6 else 4)
    for lane, dynamics in enumerate(
        [*machines, *[machines[0]] * (LANES - len(machines))]
    ):
        system = dynamics.system()
        for part in ("stiffness", "damping"):
            assert_allclose(
                rebuilt(group, part, lane, n), getattr(system, part), rtol=0, atol=0
            )
        expected = {
            "inverse_mass": 1 / system.mass,
            "rotation": system.rotation,
            "held": system.stiffness @ system.rotation,
            "carried": system.mass * system.rotation,
        }
        for name, values in expected.items():
            assert_allclose(
                getattr(group, name)[lane::LANES],
                values,
                rtol=1e-15,
                atol=1e-12 * np.abs(values).max(),
            )


def test_one_compiled_program_takes_every_machine(machine, dynamics_of):
    """Arrays of another layout would have it compiled anew, which takes most of a minute."""
    course = {"operating.speed_profile": [[0, 1], [1, 2]]}
    kinds = [
        numba.typeof(pack([dynamics_of(machine(changes))], 1e-6))
        for changes in ({}, ROTORS, course)
    ]
    assert kinds[0] == kinds[1] == kinds[2]


def mesh_forces(dynamics, law, n):
    """Forces and torques of a mesh law on every degree of freedom, (dof,)."""
    normal, friction, moment_p, moment_w, along = law[:5]
    radius_p, radius_w = (
        dynamics.table.pair.pinion.base_radius,
        dynamics.table.pair.wheel.base_radius,
    )
    pinion = friction, normal, radius_p * (along - normal) + moment_p
    wheel = -friction, -normal, radius_w * normal + moment_w
    return np.array([*pinion, *wheel, *np.zeros(n - 6)])


@pytest.mark.parametrize(
    "time", [0.0, (10**8 + 6) * BRIEF], ids=["recentred", "as_it_is"]
)
@pytest.mark.parametrize(
    "changes", [{}, ROTORS, LIGHT], ids=["pair", "rotors", "light"]
)
def test_the_compiled_right_hand_side_is_that_of_the_matrices(
    machine, dynamics_of, changes, time
):
    """M q'' = f - K q - C v + mesh, also where the pinion's turn is first taken out of all rotations."""
    dynamics, rng = dynamics_of(machine(changes)), np.random.default_rng(6)
    system, direction, n = (
        dynamics.system(),
        dynamics.approach_direction(),
        len(dynamics.dofs),
    )
    for _ in range(10):
        q = (
            rng.uniform(0.8, 1.5) * dynamics.static_start(0.0)
            + 1e-3 * rng.standard_normal() * system.rotation
        )
        q[[0, 3]] += 1e-5 * rng.standard_normal(2)
        q[6:] += 1e-4 * rng.standard_normal(n - 6)
        v = 1e-3 * rng.standard_normal(n) + rng.standard_normal() * system.rotation
        radius, speed = dynamics.table.pair.pinion.base_radius, dynamics.operating.speed
        roll = dynamics.start_roll + radius * (speed * time + q[2])
        (law,) = laws(
            dynamics, [(roll, direction @ q, direction @ v, radius * (speed + v[2]))]
        )
        assert law[0] > 0
        mesh = mesh_forces(dynamics, law, n)
        expected = (
            system.force - system.stiffness @ q - system.damping @ v + mesh
        ) / system.mass
        found = right_hand_side(dynamics, time, q, v)
        terms = (
            np.abs(system.force) + np.abs(system.stiffness) @ np.abs(q) + np.abs(mesh)
        )
        assert np.abs((found - expected) * system.mass / terms).max() < 1e-9


def test_slowest_decay_of_an_oscillator():
    system = LumpedSystem(
        names=("a",), mass=np.array([2.0]), stiffness=np.eye(1) * 50, damping=np.eye(1) * 4, force=np.zeros(1),
        rotation=np.zeros(1),
    )  # fmt: skip
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
        assert_allclose(
            found[1:], [60.8, 178.6, 269.4, 690.2, 11704], rtol=3e-3, atol=0
        )

    def test_exactly_one_rigid_mode_without_the_drive(self, modes):
        found = modes(3.28e8, drive=False)
        assert (found < 1e-2).sum() == 1
        assert (modes(0.0, drive=False) < 1e-2).sum() == 2

    def test_the_drive_holds_it_at_five_hertz(self, modes, xiamen):
        assert_allclose(
            modes(3.28e8)[0] * 2 * np.pi,
            xiamen.operating.drive_frequency * 2 * np.pi,
            rtol=2e-3,
            atol=0,
        )
