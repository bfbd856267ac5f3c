"""Motor and load on their couplings, and the whole machine under changing speed and torque."""

import math
from dataclasses import replace

import numpy as np
import pytest
from chord_tables import repeated
from closeness import assert_close
from refusals import refused
from scipy.optimize import brentq

from gensig.dynamics import mesh_teeth
from gensig.dynamics.lanes import near_positions
from gensig.dynamics.pair import DOFS, PAIR_DOFS, Rotor
from gensig.mesh.tooth_table import GearTeeth
from gensig.operation.courses import Profile
from gensig.systems.registry import read_system

MOTOR = Rotor(
    inertia=2e-3,
    coupling_stiffness=3e3,
    coupling_damping_ratio=0.05,
)
LOAD = Rotor(
    inertia=8e-2,
    coupling_stiffness=1e4,
    coupling_damping_ratio=0.03,
)
MACHINES = {
    "pair": {},
    "motor": {"motor": MOTOR},
    "load": {"load": LOAD},
    "both": {"motor": MOTOR, "load": LOAD},
}
RATIO = 84 / 23


def profile(*factors, begin=0.5):
    return Profile(times=(begin, 1.0), factors=factors)


COURSES = {
    "constant": {},
    "slower": {"speed_profile": profile(0.3, 1.0)},
    "lighter": {"torque_profile": profile(0.3, 1.0)},
    "ramp": {
        "speed_profile": profile(0.5, 1.5, begin=-1.0),
        "torque_profile": profile(0.8, 1.2, begin=-1.0),
    },
    "braking": {"speed_profile": profile(1.2, 1.0, begin=-1.0)},
}


@pytest.fixture(scope="module")
def smooth(machine):
    """The pair without friction."""
    return machine({"mesh.friction_coefficient": 0.0})


@pytest.fixture(scope="module", params=MACHINES)
def rotors(request):
    return MACHINES[request.param]


@pytest.fixture(scope="module")
def running(smooth, running_of, rotors):
    return replace(running_of(smooth), **rotors)


@pytest.fixture(scope="module")
def whole(smooth, running_of):
    """Motor, pair and load."""
    return replace(running_of(smooth), **MACHINES["both"])


def on_course(running, name):
    return replace(
        running,
        operating=replace(running.operating, **COURSES[name]),
    )


def ends(running):
    """Degrees of freedom of the drive torque and the load torque."""
    driver = "motor_rotation" if running.motor else "pinion_rotation"
    driven = "load_rotation" if running.load else "wheel_rotation"
    return running.dofs.index(driver), running.dofs.index(driven)


def drive_matrices(running):
    """Spring and damper of the drive alone, (dof, dof) each."""
    system = running.equations
    operating = running.operating
    unit = np.zeros(system.governed_stiffness.shape)
    unit[ends(running)[0], ends(running)[0]] = 1.0
    rate = 2 * math.pi * operating.drive_frequency
    reduced = system.rotation**2 @ system.mass
    damping = 2 * operating.drive_damping_ratio * reduced * rate
    return unit * reduced * rate**2, unit * damping


def residual(running, time, q):
    """Remaining forces and torques at a state at rest in the rotating frame, (dof,)."""
    system = running.equations
    nominal = running.operating.nominal(np.array([time]))
    radius = running.table.pair.pinion.base_radius
    direction = running.approach_direction()
    states = running.teeth.states(
        running.teeth.start_roll + radius * (nominal.angle + q[2])
    )

    def excess(force):
        return running.teeth.static(states, force).approach[0] - q @ direction

    force = brentq(excess, 1e-3, 1e5, rtol=1e-12)
    inertia = system.mass * system.rotation * nominal.acceleration
    applied = (
        running.dynamics.forces(np.array([time]))[0]
        - inertia
        - system.governed_stiffness @ q
    )
    return applied - direction * force


class TestEquations:
    def test_degrees_of_freedom(self, running, rotors):
        system = running.equations
        direction = running.approach_direction()
        names = (
            *PAIR_DOFS,
            *[f"{name}_rotation" for name in rotors],
        )

        assert running.dofs == running.bodies.names == names
        assert set(running.dofs) <= set(DOFS)
        assert system.mass[6:].tolist() == [rotor.inertia for rotor in rotors.values()]
        assert direction.shape == (len(running.dofs),)
        assert np.all(direction[6:] == 0)

        turning = {
            "pinion_rotation": 1,
            "motor_rotation": 1,
            "wheel_rotation": 1 / RATIO,
            "load_rotation": 1 / RATIO,
        }
        expected = [turning.get(name, 0) for name in running.dofs]
        assert_close(system.rotation, expected, 1e-15)

    def test_a_common_rotation_strains_only_the_drive(self, running):
        system, (drive_k, drive_c) = (
            running.equations,
            drive_matrices(running),
        )
        matrices = (
            (system.governed_stiffness, drive_k),
            (system.governed_damping, drive_c),
        )
        for matrix, drive in matrices:
            strain = (matrix - drive) @ system.rotation
            assert_close(strain, 0, atol=1e-12 * np.abs(matrix).max())
        approach = running.approach_direction() @ system.rotation

        assert_close(approach, 0, atol=1e-15)

    def test_the_drive_holds_all_that_rotates(self, running, smooth):
        """At its frequency and damping ratio for every machine."""
        system = running.equations
        operating = smooth.operating
        rotation = system.rotation
        inertia = rotation @ np.diag(system.mass) @ rotation
        rate = math.sqrt(rotation @ system.governed_stiffness @ rotation / inertia)
        damping = rotation @ system.governed_damping @ rotation

        assert_close(
            rate / (2 * math.pi),
            operating.drive_frequency,
            1e-12,
        )
        assert_close(
            damping / (2 * inertia * rate),
            operating.drive_damping_ratio,
            1e-12,
        )

    def test_torques_act_at_the_ends_and_balance(self, running, smooth):
        system = running.equations
        lead = np.zeros(len(running.dofs))
        if running.motor:
            lead[6] = smooth.operating.torque / MOTOR.coupling_stiffness
        driving = (
            running.dynamics.forces(np.zeros(1))[0] - drive_matrices(running)[0] @ lead
        )

        assert np.flatnonzero(driving).tolist() == sorted(ends(running))
        assert_close(
            driving[list(ends(running))],
            [20, -20 * RATIO],
            1e-12,
        )
        assert_close(driving @ system.rotation, 0, atol=1e-12)


class TestTorsion:
    """Frequencies of the shafts against closed forms, without the drive."""

    @pytest.mark.parametrize(
        ("rotor", "gear", "end"),
        [(MOTOR, "pinion", "motor"), (LOAD, "wheel", "load")],
    )
    def test_two_inertias_on_a_spring(self, whole, rotor, gear, end):
        equations = whole.equations
        names = f"{gear}_rotation", f"{end}_rotation"
        index = [whole.dofs.index(name) for name in names]
        block = np.ix_(index, index)
        free = replace(
            equations,
            mass=equations.mass[index],
            stiffness=equations.stiffness[block],
            damping=equations.damping[block],
            held=np.zeros(2),
            meshes=(),
        )
        rates = free.rates(np.zeros(0))
        turning = rates[np.imag(rates) > 1.0]
        expected = math.sqrt(rotor.coupling_stiffness * sum(1 / free.mass))
        ratio = -np.real(turning) / np.abs(turning)

        assert_close(np.abs(turning), [expected], 1e-9)
        assert_close(ratio, [rotor.coupling_damping_ratio], 1e-9)
        assert (np.abs(rates) < 1e-6 * expected).sum() == 2


class TestStart:
    @pytest.mark.parametrize("course", COURSES)
    @pytest.mark.parametrize("time", [-0.43, 0.0])
    def test_static_equilibrium_of_every_body(self, running, course, time):
        moving = on_course(running, course)
        left = residual(moving, time, moving.dynamics.static_start(time))
        assert_close(left, 0, atol=1e-6 * 20 * RATIO)

    def test_friction_is_the_only_imbalance(self, xiamen, running_of, rotors):
        """Its mean is in the drive; the statics have none."""
        running = replace(running_of(xiamen), **rotors)
        left = residual(running, 0.0, running.dynamics.static_start(0.0))
        friction, (driver, _) = running.dynamics.friction_torque, ends(running)
        assert friction[driver] >= running.friction_torque() > 0.01
        assert_close(left[driver], friction[driver], 1e-3)
        assert_close(np.delete(left, driver), 0, atol=1e-4)

    def test_neither_torque_nor_coupling_moves_the_pinion(self, running):
        for course in ("constant", "slower", "lighter"):
            start = on_course(running, course).dynamics.static_start(-0.2)
            assert abs(start[2]) < 1e-6 * np.abs(start).max()

    def test_the_start_follows_the_nominal_angle(self, running):
        start = on_course(running, "slower").dynamics.static_start(-0.4)
        assert_close(
            start,
            running.dynamics.static_start(-0.12),
            1e-12,
            atol=1e-18,
        )
        assert np.abs(start - running.dynamics.static_start(-0.4)).max() > 1e-8

    def test_without_torque_everything_is_at_rest(self, running):
        course = Profile(times=(0.0, 1.0), factors=(0.0, 1.0))
        idle = replace(running.operating, torque_profile=course)
        start = replace(running, operating=idle).dynamics.static_start(-0.2)
        assert np.abs(start).max() < 1e-5 * np.abs(running.dynamics.rest).max()


KEYS = (
    "inertia_kg_m2",
    "coupling_stiffness_nm_per_rad",
    "coupling_damping_ratio",
)
REFUSALS = [
    (
        {f"system.{side}.{key}": value for key, value in values.items()},
        f"system.{side}{text}",
    )
    for side in ("motor", "load")
    for values, text in [
        ({KEYS[0]: 0}, ".inertia_kg_m2 = 0 must be positive"),
        (
            {KEYS[0]: -1e-3},
            ".inertia_kg_m2 = -0.001 must be positive",
        ),
        (
            {KEYS[0]: "big"},
            ".inertia_kg_m2 = 'big' is not a number",
        ),
        (
            {KEYS[0]: math.nan},
            ".inertia_kg_m2 = nan is not finite",
        ),
        (
            {KEYS[0]: 1, KEYS[1]: 0},
            ".coupling_stiffness_nm_per_rad = 0 must be positive",
        ),
        (
            {KEYS[0]: 1, KEYS[1]: None},
            ".coupling_stiffness_nm_per_rad is null",
        ),
        (
            {KEYS[0]: 1, KEYS[2]: -0.1},
            ".coupling_damping_ratio = -0.1 must be positive",
        ),
    ]
] + [
    (
        {"system.motor": 5},
        "system.motor = 5 must be a group of keys",
    ),
    (
        {"system.load": {"inertia": 1}},
        "system.load: 'inertia' has the wrong unit; write it as 'inertia_kg_m2'",
    ),
    (
        {"system.motor": {KEYS[0]: 1.0}},
        f"system.motor: missing {KEYS[1]}",
    ),
]


class TestConfiguration:
    def test_motor_and_load_are_optional(
        self, machine, xiamen, running_of, config_with
    ):
        assert xiamen.motor is xiamen.load is None
        assert running_of(xiamen).dofs == PAIR_DOFS

        config = config_with({"system.motor": None})
        section = config["system"].without("load")
        system = read_system(config.with_entries(system=section))

        assert system.motor is system.load is None

        load = {
            f"system.load.{key}": value
            for key, value in zip(KEYS, (0.5, 2.5e4, 0.2), strict=True)
        }
        system = machine({"system.motor.inertia_kg_m2": 2e-3, **load})
        assert system.motor == MOTOR
        assert [
            system.load.inertia,
            system.load.coupling_stiffness,
        ] == [0.5, 2.5e4]
        assert system.load.coupling_damping_ratio == 0.2

    @pytest.mark.parametrize(("changes", "text"), REFUSALS)
    def test_refusals(self, machine, changes, text):
        with refused(text):
            machine(changes)

    def test_an_unknown_key_is_refused(self, config_with):
        text = "system: unknown key 'motr'; known: kind, supports, motor, load"
        with refused(text):
            read_system(config_with().with_keys("system", motr={}))


class TestMeanStiffness:
    def test_it_is_that_of_the_commonest_teeth(self, smooth):
        table = smooth.mesh_table()
        force = smooth.mesh_force
        sound = mesh_teeth.mean_mesh_stiffness(table, force)
        of_pinion, of_wheel = table.parts
        doubled = repeated(of_pinion, 2)
        doubled.compliance[1] *= 2.0
        parts = doubled, of_wheel
        present = np.array([True, True])

        def softer(n_soft):
            kind = (np.arange(23) < n_soft).astype(int)
            pinion = GearTeeth(kind=kind, present=present)
            changed = replace(table, pinion=pinion, parts=parts)
            return mesh_teeth.mean_mesh_stiffness(changed, force)

        assert softer(11) == sound
        assert softer(12) == softer(23) < 0.8 * sound


def test_distant_gears_are_followed_everywhere(whole):
    far = replace(whole.teeth, errors=(np.zeros(23), np.full(84, 2e-4)))
    position = whole.table.position
    assert near_positions(far) == (position[0], position[-1])
    first, last = near_positions(whole.teeth)
    assert position[0] < first < last < position[-1]
