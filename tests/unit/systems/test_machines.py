"""Laws that every machine obeys, whatever turns in it; and that no kind overrides a method of another."""

import inspect
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gensig.dynamics.pair import DOFS
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.base import Machine, simulate_together
from gensig.systems.mesh_signals import mesh_signals
from gensig.systems.pair_machine import GearPairMachine, PairMachine, pair_dynamics
from gensig.systems.run import CHECKS, Run, Start
from gensig.units import SPEED

MACHINES = {
    "spur_pair": ("experiment=quickstart",),
    "helical_pair": ("experiment=helical",),
    "engine_line": ("experiment=engine_test_point",),
    "two_stage_line": ("experiment=two_stage",),
}
KNOWN_CHANNELS = {*DOFS, "crank_speed", "motor_speed"}
pytestmark = pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning")


def read(words, *more):
    return read_machine(
        read_request([*words, "operating.duration_s=0.02", *more]).config
    )


@pytest.fixture(scope="module", params=MACHINES)
def any_machine(request):
    return read(MACHINES[request.param])


@pytest.fixture(scope="module")
def kinds():
    """All classes of machines, the kinds and what they derive from."""
    made = [type(read(words)) for words in MACHINES.values()]
    return {one for kind in made for one in kind.__mro__ if issubclass(one, Machine)}


def is_abstract(member):
    return getattr(member, "__isabstractmethod__", False)


def overridden(kind):
    """Concrete members of a base of ``kind`` that a class below it defines again."""
    found = []
    for number, lower in enumerate(kind.__mro__):
        for base in kind.__mro__[number + 1 :]:
            for name in vars(lower).keys() & vars(base).keys():
                concrete = not is_abstract(vars(base)[name])
                if (
                    issubclass(base, Machine)
                    and concrete
                    and not name.startswith("__")
                    and name != "_abc_impl"
                ):
                    found.append(f"{lower.__name__}.{name} of {base.__name__}")
    return found


def test_no_kind_overrides_a_concrete_member(kinds):
    assert len(kinds) == 5
    assert [text for kind in kinds for text in overridden(kind)] == []


def test_an_override_is_noticed():
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Other(GearPairMachine):
        @property
        def ratio(self):
            return 2.0

        def require_drive(self):
            """Abstract in the base: to be defined."""

    assert overridden(Other) == ["Other.ratio of GearPairMachine"]


def test_every_kind_is_abstract_or_final(kinds):
    for kind in kinds:
        assert inspect.isabstract(kind) != getattr(kind, "__final__", False), kind


def test_the_name_of_version_0_9_is_the_machine(any_machine):
    assert isinstance(any_machine, PairMachine)


def unknown_gears(gears, meshes):
    return [
        name
        for mesh in meshes
        for name in (mesh.driving, mesh.driven)
        if name not in gears
    ]


def test_gears_have_their_names_and_bodies(any_machine):
    gears, bodies = any_machine.gears, any_machine.bodies
    assert [gear.name for gear in gears.values()] == list(gears)
    assert set(bodies) == set(gears)
    assert all(body.inertia > 0.0 for body in bodies.values())
    assert list(gears)[:2] == list(
        any_machine.pair.gears
    )  # those that records follow come first
    for name, gear in any_machine.pair.gears.items():
        assert gears[name] == gear
        assert getattr(any_machine, name) == bodies[name]


def test_meshes_are_of_gears_that_exist(any_machine):
    gears, meshes = any_machine.gears, any_machine.meshes
    assert unknown_gears(gears, meshes) == []
    assert unknown_gears(gears, [replace(meshes[0], driven="nobody")]) == ["nobody"]
    for mesh in meshes:
        assert mesh.driving != mesh.driven
        assert gears[mesh.driving].n_teeth == mesh.pair.pinion.n_teeth
        assert gears[mesh.driven].n_teeth == mesh.pair.wheel.n_teeth
    (followed,) = [mesh for mesh in meshes if mesh.followed]
    assert followed.pair == any_machine.pair
    assert {name for mesh in meshes for name in (mesh.driving, mesh.driven)} == set(
        gears
    )


def test_each_gear_of_a_line_turns_as_its_meshes_say():
    """Names follow the gears through all meshes: speeds from tooth counts are those of the line's nodes."""
    line = read(MACHINES["engine_line"])
    drive = line.engine.drive
    ratio = np.abs(drive.line.speed_ratio)
    speed = {}
    for mesh, own in zip(line.meshes, drive.line.meshes, strict=True):
        speed.setdefault(mesh.driving, ratio[drive.line.gears[own.driving].node])
        turned = (
            speed[mesh.driving] * mesh.pair.pinion.n_teeth / mesh.pair.wheel.n_teeth
        )
        assert speed.setdefault(mesh.driven, turned) == pytest.approx(turned, rel=1e-9)
    assert len(speed) == len(drive.line.gears) == len(line.gears)


def with_channels(machine, names):
    return replace(machine, sensing=replace(machine.sensing, channels=tuple(names)))


def without_path(machine):
    plain = replace(machine.sensing, path=None, sensors=None, nuisances=())
    return replace(machine, sensing=plain)


def test_the_declared_channels_are_those_that_check_takes(any_machine):
    machine = without_path(any_machine)
    with_channels(machine, machine.channels).check()
    others = KNOWN_CHANNELS - set(machine.channels)
    assert others
    for name in others:
        with pytest.raises(ConfigError, match=rf"sensing\.channels: no channel {name}"):
            with_channels(machine, [name]).check()


@pytest.mark.parametrize("name", ["spur_pair", "helical_pair"])
@pytest.mark.parametrize("is_driven", [False, True])
def test_the_channels_of_a_pair_are_its_degrees_of_freedom(name, is_driven):
    rotor = "{inertia_kg_m2: 0.01, coupling_stiffness_nm_per_rad: 1e4, coupling_damping_ratio: 0.1}"
    words = [f"system.{end}={rotor}" for end in ("motor", "load")] if is_driven else []
    machine = read(MACHINES[name], *words)
    assert machine.channels == pair_dynamics(Run(system=machine, faults=())).dofs
    assert ("motor_rotation" in machine.channels) == is_driven


def parts(table):
    """Every array and number of a table, by its path."""
    found = {}
    for field in fields(table):
        value = getattr(table, field.name)
        below = parts(value) if is_dataclass(value) else {"": value}
        found |= {f"{field.name}.{name}": one for name, one in below.items()}
    return found


def is_same(table, other):
    one, two = parts(table), parts(other)
    return one.keys() == two.keys() and all(
        np.array_equal(one[key], two[key]) for key in one
    )


def test_the_table_without_faults_is_the_sound_one(any_machine):
    sound = any_machine.mesh_table()
    specimen = perfect_specimen(any_machine.pair.pinion, any_machine.pair.wheel)
    assert is_same(any_machine.mesh_table(specimen.forms), sound)
    assert not any(
        np.any(value) for key, value in parts(sound).items() if key.endswith("kind.")
    )
    assert sound.pair == any_machine.pair
    missing = read_faults({"kind": "missing_tooth", "gear": "pinion", "tooth": 0})
    assert not is_same(any_machine.mesh_table(missing), sound)


def test_a_record_starts_perfect_and_nominal(any_machine):
    plain = any_machine.simulate()
    perfect = any_machine.simulate(
        (),
        start=Start(tooth_pinion=0, tooth_wheel=0, phase=0.0),
        specimen=perfect_specimen(any_machine.pair.pinion, any_machine.pair.wheel),
        gearbox=nominal_gearbox(len(any_machine.sensing.channels)),
    )
    assert_array_equal(plain.acceleration, perfect.acceleration)
    assert plain.acceleration.shape[0] == len(any_machine.sensing.channels)
    assert plain.integration_check in CHECKS
    later = any_machine.simulate(start=Start(phase=0.3))
    assert not np.array_equal(plain.acceleration, later.acceleration)


def test_kinds_are_simulated_together_in_the_order_given():
    machines = [read(words) for words in MACHINES.values()]
    runs = [Run(system=machines[number], faults=()) for number in (3, 0, 1, 0)]
    for run, record in zip(runs, simulate_together(runs), strict=True):
        assert_array_equal(record.acceleration, run.system.simulate().acceleration)


def test_set_points_have_finite_loads(any_machine):
    force = any_machine.mesh_force
    assert np.isfinite(force)
    assert force > 0.0
    assert any_machine.ratio > 0.0
    assert any_machine.load_exponent >= 0
    assert isinstance(any_machine.torque_of, str)


def test_loads_of_teeth_are_recorded_where_they_are_known(any_machine):
    if any_machine.most_pairs:
        assert mesh_signals(None, 5, any_machine.most_pairs)[
            "mesh_load_share"
        ].shape == (
            any_machine.most_pairs,
            5,
        )
    else:
        with pytest.raises(
            ConfigError, match=r"dataset\.store_mesh_state: a drive line does not tell"
        ):
            mesh_signals(None, 5, any_machine.most_pairs)


def test_the_driven_tooth_is_one_of_the_wheel(any_machine):
    pair = any_machine.pair
    for tooth, drawn in pairwise(range(0, pair.wheel.n_teeth, 5)):
        assert 0 <= any_machine.driven_tooth(tooth, drawn) < pair.wheel.n_teeth


def test_every_toothed_wheel_has_a_disc_and_a_channel(any_machine):
    wheels = [name for name in any_machine.channels if name.endswith(SPEED)]
    assert len(any_machine.draw_discs(np.random.default_rng(0))) == len(wheels)
