"""Lines in the two-evaluation core: a pair as a line, two stages, and what they agree with."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fault_cases import one
from stacked_motions import integrate, stacked

from gensig.driveline.reading import read_line_machine
from gensig.driveline.side_by_side.line_dynamics import LineDynamics
from gensig.driveline.side_by_side.line_integration import integrate_lines
from gensig.driveline.time.course import ShaftTorque, constant_speed
from gensig.driveline.time.geared_line import GearedLine
from gensig.driveline.time.line_mesh import pair_mesh
from gensig.dynamics.backends.base import Integration
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import PINION_ROTATION, WHEEL_ROTATION
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.plan.request import read_request
from gensig.sensing.manufacturing import draw_specimen
from gensig.systems.base import further_gears, simulate_together
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import CleanRecord, Run, Start

RATE = 51200.0
CHANNELS = ("pinion_x", "pinion_y", "wheel_x", "wheel_y", "wheel_rotation")
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


LOSSLESS = (
    *TWO_STAGE,
    "system.loss_factor.shaft=0",
    "system.loss_factor.coupling=0",
    "operating.drive_frequency_hz=20",
)


def as_line(pair):
    """A gear pair without rotors as a line of one mesh."""
    system, damping = pair.system(), pair.mesh_damping / pair.mesh_force
    teeth = pair.start_tooth_pinion, pair.start_tooth_wheel
    mesh = pair_mesh(
        "pair",
        pair.table,
        direction=pair.approach_direction(),
        roll_dof=PINION_ROTATION,
        damping=damping,
        errors=(pair.pinion_error, pair.wheel_error),
        tilts=(pair.pinion_tilt, pair.wheel_tilt),
        start_teeth=teeth,
        start_phase=pair.start_phase,
    )
    held = np.zeros(len(system.mass))
    held[PINION_ROTATION] = math.sqrt(pair.drive_stiffness)
    drive_damping = system.damping[PINION_ROTATION, PINION_ROTATION]
    friction_torque = np.zeros(len(system.mass))
    friction_torque[PINION_ROTATION] = pair.friction_torque()
    line = GearedLine(
        names=system.names,
        mass=np.diag(system.mass),
        damping=system.damping,
        stiffness=system.stiffness,
        rotation=system.rotation,
        meshes=(mesh,),
        held=held,
        held_damping=drive_damping / pair.drive_stiffness,
        friction_torque=friction_torque,
    )
    torque = pair.operating.torque
    driven = np.array([-torque * pair.table.pair.ratio])
    running = SimpleNamespace(
        line=line,
        course=constant_speed(pair.operating.speed),
        torques=(
            ShaftTorque(dof=PINION_ROTATION, table=np.array([torque])),
            ShaftTorque(dof=WHEEL_ROTATION, table=driven),
        ),
        mesh_force=np.array([pair.mesh_force]),
    )
    return LineDynamics(
        running=running,
        pairs=(pair,),
        touched=np.arange(6)[None],
        senses=np.array([-1.0]),
        angles=(PINION_ROTATION,),
    )


@pytest.mark.parametrize(
    ("changes", "faults"),
    [({}, (one("crack", tooth=4),)), ({}, MISSING), (BOUNCING, MISSING)],
    ids=["crack", "missing", "bouncing"],
)
def test_a_pair_as_a_line_moves_as_the_pair(machine, dynamics_of, changes, faults):
    """Other loops, the same law: friction, back flanks, kinks and the start of teeth agree."""
    errors = np.random.default_rng(3).normal(0.0, 2e-6, (2, 84))
    teeth = {"pinion_error": errors[0, :23], "wheel_error": errors[1]}
    pair = dynamics_of(machine({**QUICK, **changes}), faults, **teeth)
    assert_moves_as_a_line(pair)


def test_a_pair_with_errors_of_manufacture_moves_as_the_pair(machine):
    """Runout, pitch errors and profile slopes that differ from tooth to tooth."""
    system = machine({**QUICK, "quality.iso1328_grade": 6})
    run = run_of(system, specimen=specimen_of(system))
    pair = pair_dynamics(run)
    assert np.ptp(pair.pinion_tilt) > 1e-5
    assert_moves_as_a_line(pair)


def assert_moves_as_a_line(pair):
    """Check that a pair and the line of one mesh that is made of it have one motion."""
    solver = Solver(oversampling=5, precision="float64", backend="nystroem")
    record = {"sampling_rate": RATE, "duration": 0.05, "channels": CHANNELS}
    expected = integrate([pair], solver, **record)
    integration = Integration(
        **record,
        with_mesh_state=False,
        oversampling=5,
        precision="float64",
        max_error=None,
    )
    found = stacked(integrate_lines([as_line(pair)], integration))

    assert in_band_error(found.acceleration, expected.acceleration, RATE)[0] < 1e-5
    assert np.abs(found.angle - expected.angle).max() < 1e-7
    assert np.abs(found.contact_loss - expected.contact_loss).max() < 1e-3


def specimen_of(machine):
    """A set of gears within the grade of a machine."""
    return draw_specimen(
        np.random.default_rng(5),
        *machine.pair.gears.values(),
        machine.quality,
        others=further_gears(machine.gears, machine.meshes),
        n_mountings=len(machine.meshes) - 1,
    )


@pytest.fixture(scope="module")
def two_stage():
    """A two-stage gearbox with lateral motion, as its experiment has it."""
    return read_line_machine(read_request(list(TWO_STAGE)).config)


def run_of(machine, faults=(), **changes):
    """A run that begins between teeth."""
    start = Start(tooth_pinion=3, tooth_wheel=5, phase=0.3)
    return Run(system=machine, faults=tuple(faults), start=start, **changes)


def recorded(*runs):
    """Records of runs, none of which fails."""
    records = simulate_together(runs)
    assert all(isinstance(record, CleanRecord) for record in records), records
    return records


def with_solver(machine, **changes):
    """The machine with other options of its solver."""
    return replace(machine, solver=replace(machine.solver, **changes))


def test_two_stages_are_accurate_to_a_thousandth(two_stage):
    exact = with_solver(two_stage, oversampling=40, max_error=None)
    crack = (one("crack", tooth=4),)
    runs = [run_of(machine, crack) for machine in (two_stage, exact)]
    found, expected = (record.acceleration[None] for record in recorded(*runs))
    error = in_band_error(found, expected, RATE)[0]
    assert 0.0 < error < 1e-3


@pytest.mark.parametrize("grade", [None, 6], ids=["perfect", "grade 6"])
def test_two_stages_agree_with_the_implicit_method(grade):
    """Both methods have one law of the teeth, friction and tilts included.

    They differ in the dampers of the shafts, which have none here, and in where their records
    begin, which a quick governor forgets.
    """
    words = [*LOSSLESS, "sensing.channels=[pinion_x, pinion_y, wheel_y]"]
    if grade is not None:
        words.append(f"quality.iso1328_grade={grade}")
    machine = read_line_machine(read_request(words).config)
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
        assert np.linalg.norm(found - expected) < 3e-3 * size
        assert np.linalg.norm(other - expected) > 0.02 * size


def spectrum(signal):
    """Spectrum of a signal of 0.1 s from 500 Hz to 15 kHz, ten hertz apart."""
    return np.fft.rfft(signal * np.hanning(len(signal)))[50:1500]


def test_a_record_does_not_depend_on_its_neighbours(two_stage):
    runs = [
        run_of(two_stage),
        run_of(two_stage, (one("crack", tooth=4),)),
        run_of(two_stage, (MissingTooth(gear="wheel", tooth=7),)),
    ]
    together = recorded(*runs)
    for run, record in zip(runs, together, strict=True):
        (alone,) = recorded(run)
        assert alone.acceleration.tobytes() == record.acceleration.tobytes()
        assert alone.shaft_angle.tobytes() == record.shaft_angle.tobytes()
    assert together[0].acceleration.tobytes() != together[1].acceleration.tobytes()


def test_single_precision_is_as_accurate(two_stage):
    runs = [run_of(two_stage), run_of(with_solver(two_stage, precision="float32"))]
    double, single = (record.acceleration[None] for record in recorded(*runs))
    assert in_band_error(single, double, RATE)[0] < 1e-3


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


def test_the_loads_are_the_same_by_the_implicit_method():
    """Of both meshes: forces, teeth and their shares."""
    machine = read_line_machine(read_request([*LOSSLESS]).config)
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
        assert off.max() < 0.01 * expected.force.mean()
        assert np.mean(found.pinion_tooth == expected.pinion_tooth) > 0.995
        assert np.mean(found.wheel_tooth == expected.wheel_tooth) > 0.995
        assert np.median(np.abs(found.load_share - expected.load_share)) < 1e-3


def test_the_loads_are_the_same_whichever_mesh_is_followed(two_stage):
    """The second mesh of a record that follows the first one is that of one that follows it."""
    other = read_line_machine(
        read_request([*TWO_STAGE, "system.record_mesh=[5,6]"]).config
    )
    run = run_of(two_stage, with_mesh_state=True)
    stage = two_stage.line(run).line.meshes[1]
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


def test_what_the_core_does_not_cover_is_refused():
    words = [
        "system=phm09_helical_two_stage",
        "sensing=geared_line",
        "solver.backend=nystroem",
    ]
    machine = read_line_machine(read_request(words).config)
    (error,) = simulate_together([run_of(machine)])
    assert isinstance(error, SimulationError)
    assert "helical" in str(error)
    assert "solver.backend=newmark" in str(error)
