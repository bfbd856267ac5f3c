"""Motor and load on their couplings, and what a changing speed and torque do to the whole machine."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gensig.dynamics import mesh_statics
from gensig.dynamics.pair import DOFS, PAIR_DOFS, Rotor
from gensig.dynamics.system import eigenvalues
from gensig.errors import ConfigError
from gensig.mesh.load_distribution import static_mesh
from gensig.operation.courses import Profile
from gensig.systems.registry import read_system

MOTOR = Rotor(inertia=2e-3, coupling_stiffness=3e3, coupling_damping_ratio=0.05)
LOAD = Rotor(inertia=8e-2, coupling_stiffness=1e4, coupling_damping_ratio=0.03)
MACHINES = {
    "pair": {},
    "motor": {"motor": MOTOR},
    "load": {"load": LOAD},
    "both": {"motor": MOTOR, "load": LOAD},
}
COURSES = {
    "constant": {},
    "slower": {"speed_profile": Profile(times=(0.5, 1.0), factors=(0.3, 1.0))},
    "lighter": {"torque_profile": Profile(times=(0.5, 1.0), factors=(0.3, 1.0))},
    "ramp": {"speed_profile": Profile(times=(-1.0, 1.0), factors=(0.5, 1.5)),
             "torque_profile": Profile(times=(-1.0, 1.0), factors=(0.8, 1.2))},
    "braking": {"speed_profile": Profile(times=(-1.0, 1.0), factors=(1.2, 1.0))},
}  # fmt: skip


@pytest.fixture(params=MACHINES)
def rotors(request):
    return MACHINES[request.param]


@pytest.fixture(scope="module")
def smooth(machine):
    """The pair without friction."""
    return machine({"mesh.friction_coefficient": 0.0})


@pytest.fixture
def dynamics(smooth, dynamics_of, rotors):
    return replace(dynamics_of(smooth), **rotors)


@pytest.fixture
def whole(smooth, dynamics_of):
    """Motor, pair and load."""
    return replace(dynamics_of(smooth), **MACHINES["both"])


def on_course(dynamics, name):
    return replace(dynamics, operating=replace(dynamics.operating, **COURSES[name]))


def drive_matrices(dynamics):
    """Spring and damper of the drive alone, (dof, dof) each."""
    names = dynamics.dofs
    driver = names.index("motor_rotation" if dynamics.motor else "pinion_rotation")
    place = np.zeros((len(names), len(names)))
    place[driver, driver] = 1.0
    rate = 2 * math.pi * dynamics.operating.drive_frequency
    reduced = dynamics.system().rotation ** 2 @ dynamics.system().mass
    return (
        place * reduced * rate**2,
        place * 2 * dynamics.operating.drive_damping_ratio * reduced * rate,
    )


def mesh_force(dynamics, time, q):
    """Force of the pairs in contact at a state at rest, N: what gives that approach."""
    roll = dynamics.start_roll + dynamics.table.pair.pinion.base_radius * (
        dynamics.nominal(np.array([time])).angle + q[2]
    )
    states, approach = dynamics._states(roll), q @ dynamics.approach_direction()
    return brentq(
        lambda force: static_mesh(dynamics.table, states, force).approach[0] - approach,
        1e-3,
        1e5,
        rtol=1e-12,
    )


def residual(dynamics, time, q):
    """Forces and torques left over at a state at rest in the turning frame, (dof,)."""
    system, nominal = dynamics.system(), dynamics.nominal(np.array([time]))
    inertia = system.mass * system.rotation * nominal.acceleration
    applied = system.force * nominal.torque_factor - inertia - system.stiffness @ q
    return applied - dynamics.approach_direction() * mesh_force(dynamics, time, q)


class TestEquations:
    def test_a_degree_of_freedom_for_each_body_that_there_is(self, dynamics, rotors):
        system = dynamics.system()
        assert (
            dynamics.dofs
            == system.names
            == (*PAIR_DOFS, *[f"{name}_rotation" for name in rotors])
        )
        assert set(dynamics.dofs) <= set(DOFS)
        assert_allclose(
            system.mass[6:],
            [rotor.inertia for rotor in rotors.values()],
            rtol=0,
            atol=0,
        )
        direction = dynamics.approach_direction()
        assert direction.shape == (len(dynamics.dofs),)
        assert_allclose(direction[6:], 0, rtol=0, atol=0)

    def test_each_body_turns_with_the_pinion_at_its_ratio(self, dynamics):
        expected = {
            "pinion_rotation": 1,
            "motor_rotation": 1,
            "wheel_rotation": 23 / 84,
            "load_rotation": 23 / 84,
        }
        assert_allclose(
            dynamics.system().rotation,
            [expected.get(name, 0) for name in dynamics.dofs],
            rtol=1e-15,
            atol=0,
        )

    def test_turning_as_a_whole_strains_nothing_but_the_drive(self, dynamics):
        system = dynamics.system()
        for matrix, drive in zip(
            (system.stiffness, system.damping), drive_matrices(dynamics), strict=True
        ):
            assert_allclose(
                (matrix - drive) @ system.rotation,
                0,
                rtol=0,
                atol=1e-12 * np.abs(matrix).max(),
            )
        assert_allclose(
            dynamics.approach_direction() @ system.rotation, 0, rtol=0, atol=1e-15
        )

    def test_that_law_sees_a_wrong_ratio(self, whole):
        system = whole.system()
        wrong = np.where(
            np.array(system.names) == "load_rotation", 1.0, system.rotation
        )
        drive = drive_matrices(whole)[0]
        assert (
            np.abs((system.stiffness - drive) @ wrong).max()
            > 0.1 * LOAD.coupling_stiffness
        )

    def test_the_drive_holds_all_that_turns(self, dynamics, smooth):
        """At its frequency and damping ratio, whatever is driven."""
        system, operating = dynamics.system(), smooth.operating
        inertia = system.rotation @ np.diag(system.mass) @ system.rotation
        stiffness, damping = (
            system.rotation @ part @ system.rotation
            for part in (system.stiffness, system.damping)
        )
        rate = math.sqrt(stiffness / inertia)
        assert_allclose(
            rate / (2 * math.pi), operating.drive_frequency, rtol=1e-12, atol=0
        )
        assert_allclose(
            damping / (2 * inertia * rate),
            operating.drive_damping_ratio,
            rtol=1e-12,
            atol=0,
        )

    def test_torques_act_at_the_ends_and_balance(self, dynamics, smooth):
        system, lead = dynamics.system(), np.zeros(len(dynamics.dofs))
        if dynamics.motor:
            lead[6] = smooth.operating.torque / MOTOR.coupling_stiffness
        driving = system.force - drive_matrices(dynamics)[0] @ lead
        ends = (
            dynamics.dofs.index(
                "motor_rotation" if dynamics.motor else "pinion_rotation"
            ),
            (
                dynamics.dofs.index(
                    "load_rotation" if dynamics.load else "wheel_rotation"
                )
            ),
        )
        assert np.flatnonzero(driving).tolist() == sorted(ends)
        assert_allclose(driving[list(ends)], [20, -20 * 84 / 23], rtol=1e-12, atol=0)
        assert_allclose(driving @ system.rotation, 0, rtol=0, atol=1e-12)


class TestTorsion:
    """Frequencies of the shafts against closed forms, the drive left out."""

    @pytest.mark.parametrize(
        ("rotor", "names"),
        [
            (MOTOR, ("pinion_rotation", "motor_rotation")),
            (LOAD, ("wheel_rotation", "load_rotation")),
        ],
    )
    def test_two_inertias_on_a_spring(self, whole, rotor, names):
        system = whole.system()
        index = [system.names.index(name) for name in names]
        drive_k, drive_c = drive_matrices(whole)
        free = replace(
            system,
            names=names,
            mass=system.mass[index],
            stiffness=(system.stiffness - drive_k)[np.ix_(index, index)],
            damping=(system.damping - drive_c)[np.ix_(index, index)],
        )
        found = eigenvalues(free, np.zeros(2), 0.0)
        turning = found[np.imag(found) > 1.0]
        expected = math.sqrt(
            rotor.coupling_stiffness * (1 / free.mass[0] + 1 / free.mass[1])
        )
        assert_allclose(np.abs(turning), [expected], rtol=1e-9, atol=0)
        assert_allclose(
            -np.real(turning) / np.abs(turning),
            [rotor.coupling_damping_ratio],
            rtol=1e-9,
            atol=0,
        )
        assert (np.abs(found) < 1e-6 * expected).sum() == 2

    def test_three_inertias_where_teeth_and_bearings_are_rigid(self, whole):
        system, direction, ratio = whole.system(), whole.approach_direction(), 84 / 23
        matrix = (
            system.stiffness
            - drive_matrices(whole)[0]
            + 1e13 * np.outer(direction, direction)
        )
        rigid = np.diag([1e13, 1e13, 0, 1e13, 1e13, 0, 0, 0])
        root = np.sqrt(np.outer(system.mass, system.mass))
        found = np.sort(np.abs(np.linalg.eigvalsh((matrix + rigid) / root)))[:3]
        j1, j2, j3 = (
            MOTOR.inertia,
            system.mass[2] + system.mass[5] / ratio**2,
            LOAD.inertia / ratio**2,
        )
        k1, k2 = MOTOR.coupling_stiffness, LOAD.coupling_stiffness / ratio**2
        total = k1 * (1 / j1 + 1 / j2) + k2 * (1 / j2 + 1 / j3)
        product = k1 * k2 * (j1 + j2 + j3) / (j1 * j2 * j3)
        root = math.sqrt(total**2 - 4 * product)
        assert found[0] < 1e-3 * found[1]
        assert_allclose(
            found[1:], [(total - root) / 2, (total + root) / 2], rtol=2e-3, atol=0
        )


class TestStart:
    @pytest.mark.parametrize("course", COURSES)
    @pytest.mark.parametrize("time", [-0.43, 0.0])
    def test_static_equilibrium_of_every_body(self, dynamics, course, time):
        moving = on_course(dynamics, course)
        q = moving.static_start(time)
        torque = 20 * 84 / 23
        assert_allclose(residual(moving, time, q), 0, rtol=0, atol=1e-6 * torque)

    def test_the_law_sees_a_coupling_without_twist(self, whole):
        q = whole.static_start(0.0)
        for name, gear in (("motor_rotation", 2), ("load_rotation", 5)):
            untwisted = np.where(np.array(whole.dofs) == name, q[gear], q)
            assert np.abs(residual(whole, 0.0, untwisted)).max() > 10

    def test_friction_is_the_only_imbalance(self, xiamen, dynamics_of, rotors):
        """Its mean is in the drive; what the pairs in contact have of it at the start is not in the statics."""
        dynamics = replace(dynamics_of(xiamen), **rotors)
        left = residual(dynamics, 0.0, dynamics.static_start(0.0))
        assert_allclose(left[2], dynamics.friction_torque(), rtol=1e-3, atol=0)
        assert_allclose(np.delete(left, 2), 0, rtol=0, atol=1e-4)

    def test_the_pinion_stands_where_the_record_says(self, dynamics):
        """Couplings wind up around it: neither torque nor coupling moves the teeth that begin in contact."""
        for course in ("constant", "slower", "lighter"):
            assert_allclose(
                on_course(dynamics, course).static_start(-0.2)[2], 0, rtol=0, atol=0
            )

    def test_the_start_follows_the_nominal_angle(self, dynamics):
        slower = on_course(dynamics, "slower")
        assert_allclose(
            slower.static_start(-0.4),
            dynamics.static_start(-0.12),
            rtol=1e-12,
            atol=1e-18,
        )
        assert (
            np.abs(slower.static_start(-0.4) - dynamics.static_start(-0.4)).max() > 1e-8
        )

    def test_the_twist_follows_the_torque(self, whole):
        light = on_course(whole, "lighter").static_start(-0.2)
        assert_allclose(
            light[6] * MOTOR.coupling_stiffness, 0.3 * 20, rtol=1e-12, atol=0
        )
        assert_allclose(
            (light[5] - light[7]) * LOAD.coupling_stiffness,
            0.3 * 20 * 84 / 23,
            rtol=1e-9,
            atol=0,
        )

    def test_no_torque_leaves_everything_at_rest(self, dynamics):
        idle = replace(
            dynamics.operating,
            torque_profile=Profile(times=(0.0, 1.0), factors=(0.0, 1.0)),
        )
        assert_allclose(
            replace(dynamics, operating=idle).static_start(-0.2), 0, rtol=0, atol=0
        )


def test_power_in_is_stored_and_dissipated_on_a_ramp(whole):
    """The inertia force of the turning frame, with speeds and energies as an observer at rest sees them."""
    moving = on_course(whole, "ramp")
    system, direction, (drive_k, drive_c) = (
        moving.system(),
        moving.approach_direction(),
        drive_matrices(moving),
    )
    n = len(system.mass)
    stiffness = system.stiffness - drive_k + 2.5e8 * np.outer(direction, direction)
    damping = system.damping - drive_c

    def slope(time, state):
        q, v = state[:n], state[n : 2 * n]
        nominal = moving.nominal(np.array([time]))
        outside = system.force * nominal.torque_factor - drive_k @ q - drive_c @ v
        inertia = system.mass * system.rotation * nominal.acceleration
        a = (outside - inertia - damping @ v - stiffness @ q) / system.mass
        return np.concatenate(
            [v, a, [outside @ (v + system.rotation * nominal.speed), v @ damping @ v]]
        )

    def energy(time, state):
        speeds = (
            state[n : 2 * n] + system.rotation * moving.nominal(np.array([time])).speed
        )
        return 0.5 * (speeds**2 @ system.mass + state[:n] @ stiffness @ state[:n])

    start, end = (
        np.concatenate([moving.static_start(0.0), np.zeros(n), [0.0, 0.0]]),
        0.01,
    )
    state = solve_ivp(
        slope, (0.0, end), start, method="LSODA", rtol=1e-9, atol=1e-12
    ).y[:, -1]
    gained = energy(end, state) - energy(0.0, start)
    supplied, lost = state[2 * n :]
    assert lost > 0
    assert_allclose(supplied, gained + lost, rtol=1e-6, atol=0)
    # speeding up takes kinetic energy: a machine that forgot its inertia force would not balance
    assert gained > 0.1 * supplied > 0


class TestConfiguration:
    def test_neither_by_default(self, xiamen, dynamics_of):
        assert xiamen.motor is None
        assert xiamen.load is None
        assert dynamics_of(xiamen).dofs == PAIR_DOFS

    def test_both(self, machine):
        load = {
            "inertia_kg_m2": 0.5,
            "coupling_stiffness_nm_per_rad": 2.5e4,
            "coupling_damping_ratio": 0.2,
        }
        keys = {
            "system.motor.inertia_kg_m2": 2e-3,
            **{f"system.load.{key}": value for key, value in load.items()},
        }
        system = machine(keys)
        assert system.motor == Rotor(
            inertia=2e-3, coupling_stiffness=3e3, coupling_damping_ratio=0.05
        )
        assert system.load == Rotor(
            inertia=0.5, coupling_stiffness=2.5e4, coupling_damping_ratio=0.2
        )

    def test_a_whole_group_may_be_null_or_absent(self, config_with):
        config = config_with({"system.motor": None})
        system = read_system(
            config.with_entries(system=config["system"].without("load"))
        )
        assert system.motor is system.load is None

    def test_coupling_damping(self):
        assert_allclose(
            MOTOR.coupling_damping(2e-3),
            2 * 0.05 * math.sqrt(3e3 * 1e-3),
            rtol=1e-12,
            atol=0,
        )

    @pytest.mark.parametrize("side", ["motor", "load"])
    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            ({"inertia_kg_m2": 0}, ".inertia_kg_m2 = 0 must be positive"),
            ({"inertia_kg_m2": -1e-3}, ".inertia_kg_m2 = -0.001 must be positive"),
            ({"inertia_kg_m2": "big"}, ".inertia_kg_m2 = 'big' is not a number"),
            ({"inertia_kg_m2": math.nan}, ".inertia_kg_m2 = nan is not finite"),
            (
                {"inertia_kg_m2": 1, "coupling_stiffness_nm_per_rad": 0},
                ".coupling_stiffness_nm_per_rad = 0 must be positive",
            ),
            (
                {"inertia_kg_m2": 1, "coupling_stiffness_nm_per_rad": None},
                ".coupling_stiffness_nm_per_rad is null",
            ),
            (
                {"inertia_kg_m2": 1, "coupling_damping_ratio": -0.1},
                ".coupling_damping_ratio = -0.1 must be positive",
            ),
        ],
    )
    def test_refusals(self, machine, side, changes, text):
        with pytest.raises(
            ConfigError, match=re.escape(f"system.{side}{text}")
        ) as caught:
            machine({f"system.{side}.{key}": value for key, value in changes.items()})
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize(
        ("key", "value", "text"),
        [
            ("motor", 5, "system.motor = 5 must be a group of keys"),
            ("load", {"inertia": 1}, "system.load: 'inertia' has the wrong unit; write it as 'inertia_kg_m2'"),
            ("motor", {"inertia_kg_m2": 1.0}, "system.motor: missing coupling_stiffness_nm_per_rad"),
            ("motr", {}, "system: unknown key 'motr'; known: kind, supports, motor, load"),
        ],
    )  # fmt: skip
    def test_shapes(self, config_with, key, value, text):
        config = config_with().with_keys("system", **{key: value})
        with pytest.raises(ConfigError, match=re.escape(text)):
            read_system(config)


class TestMeshNumbers:
    def test_the_mean_stiffness_is_found_once_a_machine(
        self, smooth, dynamics_of, monkeypatch
    ):
        calls = []

        def counted(*arguments):
            calls.append(arguments)
            return static_mesh(*arguments)

        fresh = replace(dynamics_of(smooth), table=replace(smooth.mesh_table()))
        monkeypatch.setattr(mesh_statics, "static_mesh", counted)
        first = fresh.mean_mesh_stiffness
        assert fresh.mean_mesh_stiffness == first
        assert len(calls) == 1
        assert (
            replace(
                fresh, start_phase=0.9, **MACHINES["both"]
            ).mean_mesh_stiffness.hex()
            == first.hex()
        )
        lighter = replace(fresh, operating=replace(fresh.operating, torque=2.0))
        assert lighter.mean_mesh_stiffness < first

    def test_the_mean_stiffness_is_that_of_the_teeth_that_most_are(self, smooth):
        table, force = smooth.mesh_table(), smooth.mesh_force
        sound = mesh_statics.mean_mesh_stiffness(table, force)
        soft = np.concatenate([table.pinion.compliance, 2.0 * table.pinion.compliance])

        def softer(n_soft):
            kind = (np.arange(23) < n_soft).astype(int)
            rows = {
                name: np.repeat(getattr(table.pinion, name), 2, axis=0)
                for name in ("gap", "gap_slope", "present")
            }
            rows["compliance_slope"] = np.repeat(
                table.pinion.compliance_slope, 2, axis=0
            )
            return mesh_statics.mean_mesh_stiffness(
                replace(
                    table,
                    pinion=replace(table.pinion, compliance=soft, kind=kind, **rows),
                ),
                force,
            )

        assert softer(11) == sound
        assert softer(12) == softer(23) < 0.8 * sound

    def test_gears_too_far_apart_for_any_pair_are_followed_everywhere(self, whole):
        far = replace(whole, wheel_error=np.full(84, 2e-4))
        position = whole.table.position
        assert_allclose(far._near_positions(), position[[0, -1]], rtol=0, atol=0)
        assert len(far.exact_numbers()) == len(whole.exact_numbers())
        first, last = whole._near_positions()
        assert position[0] < first < last < position[-1]
