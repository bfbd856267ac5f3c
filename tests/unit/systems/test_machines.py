"""Laws of every machine; no kind overrides a method of another."""

import inspect
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
from closeness import assert_close
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dynamics.mesh_state import mesh_signals
from gensig.dynamics.pair import DOFS
from gensig.errors import GeometryError, SimulationError
from gensig.faults.registry import read_faults
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.base import Machine, simulate_together
from gensig.systems.integration_checks import finer, is_too_coarse
from gensig.systems.pair_machine import (
    GearPairMachine,
    running_pair,
)
from gensig.systems.registry import read_sliced_pair
from gensig.systems.run import CHECKS, Run, Start
from gensig.units import SPEED

MACHINES = {
    "spur_pair": "quickstart",
    "helical_pair": "helical",
    "engine_line": "engine_test_point",
    "two_stage_line": "two_stage",
}
KNOWN_CHANNELS = {*DOFS, "crank_speed", "motor_speed"}
pytestmark = pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning")


@cache
def read(name, *more):
    words = f"experiment={MACHINES[name]}", "operating.duration_s=0.01"
    return read_machine(read_request([*words, *more]).config)


@pytest.fixture(scope="module", params=MACHINES)
def any_machine(request):
    return read(request.param)


@pytest.fixture(scope="module")
def kinds():
    """All classes of machines, with their bases."""
    classes = [type(read(name)) for name in MACHINES]
    return {
        each for kind in classes for each in kind.__mro__ if issubclass(each, Machine)
    }


def overridden(kind):
    """Concrete members of a base of ``kind`` that a class below it defines again."""
    machines = [each for each in kind.__mro__ if issubclass(each, Machine)]
    result = []
    for lower, base in combinations(machines, 2):
        for name in vars(lower).keys() & vars(base).keys():
            is_abstract = getattr(vars(base)[name], "__isabstractmethod__", False)
            if not (is_abstract or name.startswith("__") or name == "_abc_impl"):
                result.append(f"{lower.__name__}.{name} of {base.__name__}")
    return result


def test_kinds_override_no_concrete_member_and_are_abstract_or_final(kinds):
    assert len(kinds) == 3
    assert [text for kind in kinds for text in overridden(kind)] == []
    for kind in kinds:
        assert inspect.isabstract(kind) != getattr(kind, "__final__", False), kind

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Other(GearPairMachine):
        @property
        def ratio(self):
            return 2.0

    assert overridden(Other) == ["Other.ratio of GearPairMachine"]


def test_gears_have_their_names_and_bodies(any_machine):
    gears, bodies = any_machine.gears, any_machine.bodies
    assert isinstance(any_machine, Machine)
    assert [gear.name for gear in gears.values()] == list(gears)
    assert set(bodies) == set(gears)
    assert all(body.inertia > 0.0 for body in bodies.values())

    followed = any_machine.pair.gears
    assert list(gears)[:2] == list(followed)
    for name, gear in followed.items():
        assert gears[name] == gear


def test_meshes_connect_existing_gears(any_machine):
    gears, meshes = any_machine.gears, any_machine.meshes
    for mesh in meshes:
        assert mesh.driving != mesh.driven
        assert gears[mesh.driving].n_teeth == mesh.pair.pinion.n_teeth
        assert gears[mesh.driven].n_teeth == mesh.pair.wheel.n_teeth

    (followed,) = [mesh for mesh in meshes if mesh.followed]
    assert followed.pair == any_machine.pair

    names = {name for mesh in meshes for name in (mesh.driving, mesh.driven)}
    assert names == set(gears)


def test_each_gear_of_a_line_rotates_as_its_meshes_say():
    """Speeds from tooth counts through all meshes are those of the line's nodes."""
    machine = read("engine_line")
    line, speed = machine.engine.drive.line, {}
    for mesh, of_line in zip(machine.meshes, line.meshes, strict=True):
        node = line.gears[of_line.driving].node
        driving = speed.setdefault(
            mesh.driving,
            abs(line.speed_ratio[node]),
        )
        driven = driving * mesh.pair.pinion.n_teeth / mesh.pair.wheel.n_teeth
        assert_close(
            speed.setdefault(mesh.driven, driven),
            driven,
            1e-9,
        )
    assert len(speed) == len(line.gears) == len(machine.gears)


def test_the_declared_channels_are_those_that_check_takes(any_machine):
    plain = replace(
        any_machine.sensing,
        path=None,
        sensors=None,
        nuisances=(),
    )

    def check(*channels):
        sensing = replace(plain, channels=channels)
        replace(any_machine, sensing=sensing).check()

    check(*any_machine.channels)
    others = KNOWN_CHANNELS - set(any_machine.channels)

    assert others
    for name in others:
        with refused(f"sensing.channels: no channel {name}"):
            check(name)


@pytest.mark.parametrize("name", ["spur_pair", "helical_pair"])
def test_flanks_at_rest_are_those_of_the_changed_pair(name):
    machine = read(name)
    changed = replace(
        machine,
        operating=replace(machine.operating, torque=31.0),
        material=replace(machine.material, youngs_modulus=1.9e11),
    )
    at_rest = changed.flanks
    assert at_rest.torque == 31.0
    assert at_rest.material == changed.material


def test_softened_teeth_are_of_the_hot_material():
    words = ["system=helical_pair", "heat=chongqing_rated", "heat.softening=true"]
    config = read_request(words).config
    hot = read_machine(config)
    assert hot.flanks == read_sliced_pair(config)
    assert hot.material.youngs_modulus < read("helical_pair").material.youngs_modulus


@pytest.mark.parametrize("name", ["spur_pair", "helical_pair"])
@pytest.mark.parametrize("is_driven", [False, True])
def test_the_channels_of_a_pair_are_its_degrees_of_freedom(name, is_driven):
    keys = "inertia_kg_m2: 0.01, coupling_stiffness_nm_per_rad: 1e4, coupling_damping_ratio: 0.1"
    words = [f"system.{end}={{{keys}}}" for end in ("motor", "load") if is_driven]
    machine = read(name, *words)

    assert machine.channels == running_pair(Run(system=machine, faults=())).dofs
    assert ("motor_rotation" in machine.channels) == is_driven


def parts(table):
    """Every array and number of a table, by its path."""
    result = {}
    for field in fields(table):
        value = getattr(table, field.name)
        below = {"": value}
        if is_dataclass(value):
            below = parts(value)
        if field.name == "parts":
            below = table.pairs._asdict()
        result |= {f"{field.name}.{name}": each for name, each in below.items()}
    return result


def test_the_table_without_faults_is_the_sound_one(any_machine):
    pair, table = any_machine.pair, any_machine.mesh_table()
    specimen = perfect_specimen(pair.pinion, pair.wheel)
    faults = read_faults({"kind": "missing_tooth", "gear": "pinion", "tooth": 0})
    of_specimen, of_faults = (
        any_machine.mesh_table(forms) for forms in (specimen.forms, faults)
    )
    sound, same, missing = map(
        parts,
        (table, of_specimen, of_faults),
    )

    assert all(np.array_equal(same[key], sound[key]) for key in sound)
    assert not all(np.array_equal(missing[key], sound[key]) for key in sound)
    assert not any(np.any(sound[key]) for key in sound if key.endswith("kind."))
    assert table.pair == pair


def test_a_record_starts_perfect_and_nominal(any_machine):
    pair, channels = any_machine.pair, any_machine.sensing.channels
    plain = any_machine.simulate()
    perfect = any_machine.simulate(
        start=Start(tooth_pinion=0, tooth_wheel=0, phase=0.0),
        specimen=perfect_specimen(pair.pinion, pair.wheel),
        gearbox=nominal_gearbox(len(channels)),
    )

    assert_array_equal(plain.acceleration, perfect.acceleration)
    assert plain.acceleration.shape[0] == len(channels)
    assert plain.integration_check in CHECKS

    later = any_machine.simulate(start=Start(phase=0.3))
    assert not np.array_equal(plain.acceleration, later.acceleration)


def test_wheels_that_cannot_mesh_and_drives_that_stop_are_refused():
    same_hand = "gear.helix_angle_deg=5", "+gear.wheel.helix_angle_deg=5"
    with refused("must be equal and of opposite hand", GeometryError):
        read("helical_pair", *same_hand)
    short = "gear.helix_angle_deg=0", "gear.addendum_coefficient=0.45"
    with refused("the total contact ratio 0.9", GeometryError):
        read("helical_pair", *short).require_drive()


@pytest.mark.parametrize(
    ("contact_loss", "steps", "coarse"),
    [(0.0, 32, True), (0.0, 33, False), (0.02, 10, True), (0.02, 11, False)],
)
def test_bouncing_records_are_refined_less(contact_loss, steps, coarse):
    machine = read("spur_pair")
    solver = replace(machine.solver, oversampling=steps)
    run = Run(system=replace(machine, solver=solver), faults=())
    record = replace(
        read_record(),
        integration_check="unresolved",
        contact_loss_fraction=contact_loss,
    )
    assert is_too_coarse(run, record) == coarse
    assert not is_too_coarse(run, replace(record, integration_check="error"))


def test_what_float32_is_too_coarse_for_is_made_in_float64():
    machine = read("spur_pair")
    solver = replace(machine.solver, oversampling=60, precision="float32")
    run = Run(system=replace(machine, solver=solver), faults=())
    assert is_too_coarse(run, replace(read_record(), integration_check="unresolved"))
    assert finer(run).system.solver == replace(solver, precision="float64")
    halved = finer(finer(run)).system.solver
    assert halved == replace(solver, precision="float64", oversampling=120)


@cache
def read_record():
    return read("spur_pair").simulate()


def test_kinds_are_simulated_together_in_the_order_given():
    machines = [read(name) for name in MACHINES]
    runs = [Run(system=machines[number], faults=()) for number in (3, 0, 1, 0)]
    for run, record in zip(runs, simulate_together(runs), strict=True):
        assert_array_equal(record.acceleration, run.system.simulate().acceleration)


def test_a_machine_that_nothing_holds_leaves_the_others_alone():
    loose = read("spur_pair", "gear.pinion.support.stiffness_y_n_per_m=0")
    with refused("mean torques (pinion_y, wheel_rotation); check", SimulationError):
        loose.check()
    runs = [Run(system=each, faults=()) for each in (loose, read("spur_pair"))]
    error, sound = simulate_together(runs)
    assert isinstance(error, SimulationError)
    assert_array_equal(sound.acceleration, read_record().acceleration)


def test_set_points_teeth_and_discs(any_machine):
    machine, n_teeth = any_machine, any_machine.pair.wheel.n_teeth
    assert 0.0 < machine.mesh_force < np.inf
    assert machine.ratio > 0.0
    assert machine.load_exponent >= 0
    assert isinstance(machine.torque_of, str)
    for tooth, drawn in pairwise(range(0, n_teeth, 5)):
        assert 0 <= machine.driven_tooth(tooth, drawn) < n_teeth

    wheels = [name for name in machine.channels if name.endswith(SPEED)]
    assert len(machine.draw_discs(np.random.default_rng(0))) == len(wheels)


def test_loads_of_teeth_are_recorded_where_they_are_known(any_machine):
    n_pairs = any_machine.most_pairs
    if n_pairs:
        assert mesh_signals(None, 5, n_pairs)["mesh_load_share"].shape == (n_pairs, 5)
        return
    with refused("dataset.store_mesh_state: the loads of the teeth of a drive line"):
        mesh_signals(None, 5, n_pairs)
