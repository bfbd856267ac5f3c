"""Lines in the two-evaluation core: a pair as a line, two stages, and what they agree with."""

import re
from dataclasses import replace

import numpy as np
import pytest
from fault_cases import one
from side_by_side_lines import (
    RATE,
    assert_moves_as_a_line,
    recorded,
    run_of,
    specimen_of,
    spectrum,
    with_solver,
)

from gensig import load_system
from gensig.driveline.reading import read_line_machine
from gensig.dynamics.decimation import in_band_error
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Start

QUICK = {
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
BOUNCING = {"operating.torque_nm": 2}
MISSING = (MissingTooth(gear="pinion", tooth=3),)
TWO_STAGE = (
    "experiment=two_stage",
    "solver.backend=nystroem",
    "solver.oversampling=5",
    "sensing.sampling_rate_hz=51200",
    "operating.duration_s=0.1",
    "operating.drive_frequency_hz=5",
)


HELICAL = (
    *TWO_STAGE,
    "system=phm09_helical_two_stage",
    "solver.oversampling=8",
    "operating.drive_frequency_hz=20",
)
NO_LOSS = (
    "system.loss_factor.shaft=0",
    "system.loss_factor.coupling=0",
    "operating.drive_frequency_hz=20",
)
LOSSLESS = (*TWO_STAGE, *NO_LOSS)
BOXES = {"spur": TWO_STAGE, "helical": HELICAL}


@pytest.mark.parametrize(
    ("changes", "faults"),
    [({}, (one("crack", tooth=4),)), ({}, MISSING), (BOUNCING, MISSING)],
    ids=["crack", "missing", "bouncing"],
)
def test_a_pair_as_a_line_moves_as_the_pair(machine, running_of, changes, faults):
    """Other loops, the same law: friction, back flanks, kinks and the start of teeth agree."""
    errors = np.random.default_rng(3).normal(0.0, 2e-6, (2, 84))
    teeth = {"pinion_error": errors[0, :23], "wheel_error": errors[1]}
    pair = running_of(machine({**QUICK, **changes}), faults, **teeth)
    assert_moves_as_a_line(pair.dynamics)


def test_a_pair_with_errors_of_manufacture_moves_as_the_pair(machine):
    """Runout, pitch errors and profile slopes that differ from tooth to tooth."""
    system = machine({**QUICK, "quality.iso1328_grade": 6})
    run = run_of(system, specimen=specimen_of(system))
    pair = running_pair(run)
    assert np.ptp(pair.teeth.tilts[0]) > 1e-5
    assert_moves_as_a_line(pair.dynamics)


@pytest.fixture(scope="module")
def two_stage():
    """A two-stage gearbox with lateral motion, as its experiment has it."""
    return load_system(*TWO_STAGE)


@pytest.fixture(scope="module", params=BOXES)
def box(request):
    """A two-stage gearbox of spur and one of helical gears."""
    return load_system(*BOXES[request.param])


def test_two_stages_are_accurate_to_a_thousandth(box):
    exact = with_solver(box, oversampling=40, max_error=None)
    crack = (one("crack", tooth=4),)
    runs = [run_of(machine, crack) for machine in (box, exact)]
    found, expected = (record.acceleration[None] for record in recorded(*runs))
    error = in_band_error(found, expected, RATE)[0]
    assert 0.0 < error < 1e-3


RIPPLE = "excitation.motor.torque_ripple={share: 0.05, order: 12}"
RAMP = ("operating=ramp",)


@pytest.mark.parametrize(
    ("kind", "grade", "more", "limit"),
    [
        ("spur", None, (), 3e-3),
        ("spur", 6, (), 3e-3),
        ("spur", None, (RIPPLE,), 3e-3),
        ("spur", None, (RIPPLE, *RAMP), 3e-3),
        ("helical", None, (), 3e-3),
        ("helical", 6, (), 3e-3),
    ],
)
def test_two_stages_agree_with_the_implicit_method(kind, grade, more, limit):
    """Both methods have one law of the teeth, friction, tilts and torques over an angle included.

    They differ in the dampers of the shafts, which have none here, and in where their records
    begin, which a quick governor forgets.
    """
    channels = "sensing.channels=[pinion_x, pinion_y, wheel_y]"
    words = [*BOXES[kind], *NO_LOSS, *more, channels]
    if grade is not None:
        words.append(f"quality.iso1328_grade={grade}")
    machine = load_system(*words)
    specimen = None
    if grade is not None:
        specimen = specimen_of(machine)
    slow = with_solver(machine, backend="newmark", oversampling=40)
    smooth = replace(slow, mesh=replace(slow.mesh, friction_coefficient=0.0))
    runs = [run_of(each, specimen=specimen) for each in (machine, slow, smooth)]
    records = recorded(*runs)
    for row in range(len(machine.sensing.channels)):
        found, expected, other = (
            spectrum(record.acceleration[row]) for record in records
        )
        size = np.linalg.norm(expected)
        assert np.linalg.norm(found - expected) < limit * size
        assert np.linalg.norm(other - expected) > 0.02 * size


def test_a_torque_ripple_moves_the_gears_as_the_linear_line():
    """By as many waves a turn of the motor as it has, as strongly as with meshes held."""
    words = [*LOSSLESS, "sensing.channels=[pinion_rotation]"]
    machines = [load_system(*words, *more) for more in ((), (RIPPLE,))]
    plain, rippled = (
        record.acceleration[0] for record in recorded(*map(run_of, machines))
    )
    turning, window = rippled - plain, np.hanning(len(plain))
    line = machines[1].line(run_of(machines[1]))
    (order,) = np.flatnonzero(np.abs(line.dynamics.vibration.orders - 12.0) < 1e-9)
    rate = 12.0 * float(line.dynamics.nominal.speed[0])
    at_order = np.exp(-1j * rate * np.arange(len(turning)) / RATE) * window
    found = 2.0 * abs(at_order @ turning) / window.sum()
    dof = line.dof(machines[1].driving_node)
    expected = rate**2 * abs(line.dynamics.vibration.angle[dof, order])
    assert abs(found / expected - 1.0) < 0.05


def test_torques_over_an_angle_know_no_neighbours_and_no_precision():
    """Machines of other torques and speeds side by side, each as alone, and in float32."""
    machine = load_system(*TWO_STAGE, RIPPLE)
    slower = replace(
        machine, operating=replace(machine.operating, speed=90.0, torque=20.0)
    )
    runs = [run_of(machine), run_of(slower), run_of(machine, MISSING)]
    together = recorded(*runs)
    for run, record in zip(runs, together, strict=True):
        (alone,) = recorded(run)
        assert alone.acceleration.tobytes() == record.acceleration.tobytes()
    (single,) = recorded(run_of(with_solver(machine, precision="float32")))
    double = together[0].acceleration[None]
    assert in_band_error(single.acceleration[None], double, RATE)[0] < 1e-3


def test_an_engine_moves_as_by_the_implicit_method():
    """Gas, mass and cam torques over the crank angle, losses by mode.

    Its teeth rattle, which is chaotic: the two follow each other at the orders of the engine, by
    which runs of the implicit method with other steps or lead-ins differ by 4 %.
    """
    words = (
        "experiment=engine_broken_tooth",
        "operating.duration_s=0.1",
        "solver.max_error=null",
        "sensing.channels=[pinion_rotation]",
    )
    config = read_request(list(words)).config
    implicit = read_line_machine(config)
    explicit = with_solver(implicit, backend="nystroem")
    ours, theirs = recorded(run_of(explicit), run_of(implicit))
    n_slow = round(300.0 * implicit.operating.duration)
    found, expected = (
        np.fft.rfft(record.acceleration[0])[1:n_slow] for record in (ours, theirs)
    )
    assert np.linalg.norm(found - expected) < 0.1 * np.linalg.norm(expected)


def test_a_record_does_not_depend_on_its_neighbours(box):
    runs = [
        run_of(box),
        run_of(box, (one("crack", tooth=4),)),
        run_of(box, (MissingTooth(gear="wheel", tooth=7),)),
    ]
    together = recorded(*runs)
    for run, record in zip(runs, together, strict=True):
        (alone,) = recorded(run)
        assert alone.acceleration.tobytes() == record.acceleration.tobytes()
        assert alone.shaft_angle.tobytes() == record.shaft_angle.tobytes()
    assert together[0].acceleration.tobytes() != together[1].acceleration.tobytes()


def test_single_precision_is_nearly_as_accurate(box):
    """Of the helical gearbox, which is quiet, rounding makes 7e-4."""
    machines = (
        with_solver(box, precision=precision, max_error=None)
        for precision in ("float64", "float32")
    )
    records = recorded(*map(run_of, machines))
    double, single = (record.acceleration[None] for record in records)
    assert in_band_error(single, double, RATE)[0] < 1.2e-3


def test_the_loads_of_the_teeth_are_known(two_stage):
    """The mean force of the followed mesh is the set torque's, and shares add up to 1."""
    (record,) = recorded(run_of(two_stage, with_mesh_state=True))
    mesh = record.mesh
    expected = two_stage.operating.torque / two_stage.pair.pinion.base_radius
    assert abs(mesh.force.mean() / expected - 1.0) < 0.03
    assert np.allclose(mesh.load_share.sum(axis=0)[~mesh.contact_lost], 1.0)
    assert mesh.load_share.shape[0] == two_stage.most_pairs


def test_the_loads_of_every_mesh_are_known(two_stage):
    """Mean forces are those of the torque that a mesh passes on, mesh by mesh."""
    run = run_of(two_stage, with_mesh_state=True)
    (record,) = recorded(run)
    (second,) = record.further_meshes
    first, torque = record.mesh, two_stage.operating.torque
    for state, pair, slowed in (
        (first, two_stage.pair, 1.0),
        (second, two_stage.meshes[1].pair, two_stage.pair.ratio),
    ):
        expected = slowed * torque / pair.pinion.base_radius
        assert abs(state.force.mean() / expected - 1.0) < 0.03
        assert np.allclose(state.load_share.sum(axis=0)[~state.contact_lost], 1.0)
        gears = zip(
            (state.pinion_tooth, state.wheel_tooth), pair.gears.values(), strict=True
        )
        for teeth, gear in gears:
            assert -1 <= teeth.min() < teeth.max() < gear.n_teeth
    # the wheel and the second pinion turn together, tooth by tooth
    entered = [
        np.count_nonzero(np.diff(state.pinion_tooth)) for state in (first, second)
    ]
    passed = two_stage.meshes[1].pair.pinion.n_teeth / two_stage.pair.wheel.n_teeth
    assert abs(entered[1] / entered[0] - passed) < 0.05
    plain = recorded(replace(run, with_mesh_state=False))[0]
    assert plain.acceleration.tobytes() == record.acceleration.tobytes()


@pytest.mark.parametrize(("kind", "limit"), [("spur", 0.01), ("helical", 1e-3)])
def test_the_loads_are_the_same_by_the_implicit_method(kind, limit):
    """Of both meshes: forces, teeth and their shares."""
    machine = load_system(*BOXES[kind], *NO_LOSS)
    slow = with_solver(machine, backend="newmark", oversampling=40)
    runs = [run_of(each, with_mesh_state=True) for each in (machine, slow)]
    ours, theirs = recorded(*runs)
    meshes = zip(
        (ours.mesh, *ours.further_meshes),
        (theirs.mesh, *theirs.further_meshes),
        strict=True,
    )
    for found, expected in meshes:
        off = np.abs(found.force - expected.force)
        assert off.max() < limit * expected.force.mean()
        shares = found.load_share.sum(axis=0)[~found.contact_lost]
        assert np.allclose(shares, 1.0)
        assert np.mean(found.pinion_tooth == expected.pinion_tooth) > 0.995
        assert np.mean(found.wheel_tooth == expected.wheel_tooth) > 0.995
        assert np.median(np.abs(found.load_share - expected.load_share)) < 1e-3


def test_the_loads_are_the_same_whichever_mesh_is_followed(two_stage):
    """The second mesh of a record that follows the first one is that of one that follows it."""
    other = load_system(*TWO_STAGE, "system.record_mesh=[5,6]")
    run = run_of(two_stage, with_mesh_state=True)
    stage = two_stage.line(run).dynamics.teeth[1]
    start = Start(
        tooth_pinion=stage.start_teeth[0],
        tooth_wheel=stage.start_teeth[1],
        phase=stage.start_phase,
    )
    (ours,), (theirs,) = (
        recorded(run),
        recorded(replace(run, system=other, start=start)),
    )
    (second,), (first,) = ours.further_meshes, theirs.further_meshes
    for found, expected in ((second, theirs.mesh), (first, ours.mesh)):
        off = np.abs(found.force - expected.force)
        assert off.max() < 1e-3 * expected.force.mean()
    # pairs of the other mesh count from elsewhere: they may have other rows
    for name in ("pinion_tooth", "wheel_tooth"):
        found, expected = (
            np.sort(getattr(each, name), 0) for each in (second, theirs.mesh)
        )
        assert np.mean(found == expected) > 0.999


def test_a_fault_is_engaged_in_the_mesh_that_feels_it(two_stage):
    """A missing tooth of the output gear carries nothing where its turn comes."""
    (sound,) = recorded(run_of(two_stage, with_mesh_state=True))
    teeth = sound.further_meshes[0].wheel_tooth
    tooth = int(teeth[:, teeth.shape[1] // 2].max())
    missing = MissingTooth(gear="output_gear", tooth=tooth)
    (record,) = recorded(run_of(two_stage, (missing,), with_mesh_state=True))
    (second,) = record.further_meshes
    assert not record.mesh.fault_engaged.any()
    assert second.fault_engaged[teeth.shape[1] // 2]
    assert 0.0 < second.fault_engaged.mean() < 0.1
    assert not np.any(second.wheel_tooth == tooth)


def test_a_missing_tooth_is_felt_by_its_shaft_mates_too(two_stage):
    """It unloads the first mesh, and the second one follows through the shaft."""
    sound, missing = recorded(run_of(two_stage), run_of(two_stage, MISSING))
    assert missing.contact_loss_fraction >= sound.contact_loss_fraction
    change = (missing.acceleration - sound.acceleration).std(axis=1)
    change /= sound.acceleration.std(axis=1)
    assert change[:2].min() > 0.2
    assert 0.01 < change[2:].min() < change[2:].max() < 0.2


def test_too_long_steps_are_refused_with_the_motion_that_decides_it(two_stage):
    slow = replace(two_stage, sensing=replace(two_stage.sensing, sampling_rate=4000.0))
    (error,) = simulate_together([run_of(with_solver(slow, max_error=None))])
    assert isinstance(error, SimulationError)
    found = re.search(
        r"the stiffest motion, (.*) at \d+ Hz; .* to at least (\d+)$", str(error)
    )
    assert found[1] in two_stage.ready(run_of(two_stage)).dynamics.dofs
    assert int(found[2]) > two_stage.solver.oversampling


def test_a_mesh_without_tabulated_teeth_is_refused():
    words = ["experiment=engine_broken_tooth", "system.helical_meshes=constant"]
    config = read_request([*words, "solver.backend=nystroem"]).config
    (error,) = simulate_together([run_of(read_line_machine(config))])
    assert isinstance(error, SimulationError)
    assert "takes meshes of tabulated teeth" in str(error)
    assert "solver.backend=newmark" in str(error)


def test_a_mesh_without_tabulated_teeth_has_its_force_alone():
    words = ("system.helical_meshes=constant", "dataset.store_mesh_state=true")
    few = (
        "operating.duration_s=0.02",
        "plan.n_records=1",
        "plan.n_units=1",
        "plan.classes=[healthy]",
    )
    engine = "experiment=engine_broken_tooth"
    config = read_request([engine, *words, *few]).config
    record = simulate_record(InputReader(config), make_plan(config).record(0))
    signals = record.signals
    spur, helical = "", "crankshaft_gear_large_idler_gear_"
    assert (signals[f"{spur}mesh_pinion_tooth"] >= 0).any()
    assert (signals[f"{helical}mesh_pinion_tooth"] == -1).all()
    for mesh in (spur, helical):
        force = signals[f"{mesh}mesh_force"]
        assert force.std() > 100.0
        assert ((force == 0.0) == signals[f"{mesh}contact_lost"]).all()
