"""Faults and errors on any gear of a drive line: the same machine whichever mesh records follow."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from closeness import assert_close
from line_tools import IMPLICIT
from refusals import refused

from gensig import load_system
from gensig.driveline.teeth import felt_there, is_tabulated
from gensig.driveline.time.newmark import LineSolver
from gensig.errors import FaultError
from gensig.faults.registry import read_faults
from gensig.plan.request import read_request
from gensig.record.inputs import draw_start
from gensig.sensing.chain import Sensing
from gensig.sensing.manufacturing import (
    GearErrors,
    Mounting,
    draw_gearbox,
    draw_specimen,
    nominal_gearbox,
    perfect_specimen,
)
from gensig.systems.base import further_gears
from gensig.systems.lead_in import earlier
from gensig.systems.run import Run, Start

TWO_STAGE = (
    "experiment=two_stage",
    "operating.duration_s=0.6",
    "quality.iso1328_grade=null",
    "sensing.snr_db=null",
    "operating.torque_nm=60",
    *IMPLICIT,
)
ENGINE = ("experiment=engine_test_point", "mesh.n_slices=8", "mesh.points_per_pitch=64")
SOLVER = LineSolver(sampling_rate=10240.0, oversampling=12, max_energy_residual=1e-3)
OUTPUT = "output_gear"
OUTPUT_TURN = 60.0 / 1746.0 * 5.0  # s: 32/96 and 48/80 teeth
pytestmark = pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning")


@lru_cache(maxsize=16)
def machine(*words):
    return load_system(*words)


def crack(gear, tooth=0, depth=1.5):
    options = read_request(["fault=crack"]).config["fault"]
    values = {**options, "gear": gear, "tooth": tooth, "crack_depth_mm": depth}
    return read_faults(values)[0]


def missing(gear, tooth=0):
    return read_faults({"kind": "missing_tooth", "gear": gear, "tooth": tooth})[0]


def added_by(fault, channel="wheel_rotation"):
    """What a fault adds to a channel of perfect gears, (sample,)."""
    record = machine(*TWO_STAGE, f"sensing.channels=[{channel}]")
    return record.simulate((fault,)).acceleration[0] - record.simulate().acceleration[0]


def folded(signal, turn, n_bins=80):
    """Share of a signal's energy in each part of a turn that takes so many seconds, (bin,)."""
    rate = machine(*TWO_STAGE).sensing.sampling_rate
    part = np.arange(len(signal)) / rate / turn % 1.0
    energy = np.bincount((part * n_bins).astype(int), signal**2, n_bins)
    return energy / energy.sum()


def test_a_crack_of_the_output_gear_shows_once_a_turn_of_that_gear():
    """What it adds falls on few teeth of that gear, and its power has lines at that gear's turns.

    Three turns of it are five of the wheel and fifteen of the pinion.
    """
    added = added_by(crack(OUTPUT, tooth=30))
    busiest = {
        gear: np.sort(folded(added, turns / (1746.0 / 60.0)))[-8:].sum()
        for gear, turns in machine(*TWO_STAGE).pinion_turns.items()
    }
    assert busiest[OUTPUT] > 0.85
    assert max(share for gear, share in busiest.items() if gear != OUTPUT) < 0.7

    three_turns = round(3.0 * OUTPUT_TURN * machine(*TWO_STAGE).sensing.sampling_rate)
    power = added[:three_turns] ** 2
    lines = np.abs(np.fft.rfft(power - power.mean())[:31]) ** 2
    assert lines[3::3].sum() > 0.9 * lines.sum()
    assert lines[5::5].sum() < 0.5 * lines.sum()
    assert lines[15::15].sum() < 0.5 * lines.sum()


def test_another_tooth_shows_so_many_pitches_later():
    pitch = OUTPUT_TURN / 80.0
    peaks = []
    for tooth in (20, 30):
        energy = folded(added_by(crack(OUTPUT, tooth=tooth)), OUTPUT_TURN, 800)
        smooth = np.convolve(np.tile(energy, 3), np.ones(20), "same")[800:1600]
        peaks.append(np.argmax(smooth) / 800.0 * OUTPUT_TURN)
    assert abs((peaks[1] - peaks[0]) % OUTPUT_TURN - 10.0 * pitch) < 1.5 * pitch


@pytest.mark.parametrize(
    ("fault", "side"),
    [(crack(OUTPUT, 17), "wheel"), (missing("idler_gear_2", 5), "pinion")],
)
def test_a_fault_is_the_same_whichever_mesh_is_followed(fault, side):
    """A record that follows mesh 3/4 has the motion of one that follows mesh 5/6, where the gear
    is ``side``; with the fault on the next tooth it has another one.
    """
    first = machine(*TWO_STAGE)
    second = machine(*TWO_STAGE, "system.record_mesh=[5,6]")
    ours = first.line(Run(system=first, faults=(fault,), start=Start(tooth_wheel=7)))
    stage = ours.dynamics.teeth[1]
    start = Start(
        tooth_pinion=stage.start_teeth[0],
        tooth_wheel=stage.start_teeth[1],
        phase=stage.start_phase,
    )

    def motion(line, record):
        nodes = [record.engine.drive.numbers[node] for node in (2, 5)]
        channels = [("acceleration", line.dof(node)) for node in nodes]
        moved = line.run(SOLVER, duration=0.3, channels=channels, settling=0.1)
        return np.array([moved.signals[channel] for channel in channels])

    expected = motion(ours, first)
    same = replace(fault, gear=side)
    next_one = replace(same, tooth=fault.tooth + 1)
    off = []
    for other in (same, next_one):
        run = Run(system=second, faults=(other,), start=start)
        off.append(np.std(motion(second.line(run), second) - expected))
    assert off[0] < 1e-6 * np.std(expected)
    assert off[1] > 1e-3 * np.std(expected)


@pytest.mark.parametrize("words", [TWO_STAGE, ENGINE], ids=["motor", "engine"])
@pytest.mark.parametrize("n_lead", [700, 30_000])
def test_all_teeth_turn_back_with_a_lead_in(words, n_lead, monkeypatch):
    """Every tooth of every mesh stands where the record's own start lets it turn back to."""
    record = machine(*words)
    rate = record.sensing.sampling_rate
    monkeypatch.setattr(Sensing, "n_lead", n_lead)
    for seed in range(3):
        start = draw_start(record, np.random.default_rng(seed))
        run = Run(system=record, start=start)
        whole, late = earlier(run), record.line(run)
        early = whole.system.line(whole)
        turned = (
            early.dynamics.turned
            + record.operating.speed / record.ratio * n_lead / rate
        )
        assert_close(turned, late.dynamics.turned, 1e-9)
        system = late.dynamics.system
        for there, mesh in zip(early.dynamics.teeth, system.meshes, strict=True):
            here = mesh.teeth
            speed = abs(system.rotation[mesh.turn]) / record.ratio
            rolled = speed * record.operating.speed * n_lead / rate
            rolled *= here.pair.pinion.n_teeth / (2.0 * np.pi)
            for side in (0, 1):
                position = there.start_teeth[side] + there.start_phase + rolled
                gone = position - here.start_teeth[side] - here.start_phase
                turns = gone / len(here.errors[side])
                assert abs(turns - round(turns)) < 1e-6


def test_a_start_decides_the_teeth_of_all_gears():
    """Starts that differ put other teeth of the output gear in mesh; equal ones the same."""
    record = machine(*TWO_STAGE)

    def teeth(**start):
        line = record.line(Run(system=record, start=Start(**start)))
        return line.dynamics.teeth[1].start_teeth

    assert teeth(tooth_wheel=3) == teeth(tooth_wheel=3)
    assert len({teeth(tooth_wheel=mate) for mate in range(5)}) == 5
    # ten pitches of the first stage are 10/96 of a turn of its wheel: 5 pitches of the second
    before, after = teeth(), teeth(tooth_pinion=10)
    assert (after[0] - before[0]) % 48 == (after[1] - before[1]) % 80 == 5


def specimen_of(record, seed=0):
    pair, quality = record.pair, replace(record.quality, iso1328_grade=6.0)
    quality = replace(quality, misalignment=5e-6, backlash_scatter=0.5)
    return draw_specimen(
        np.random.default_rng(seed),
        pair.pinion,
        pair.wheel,
        quality,
        others=further_gears(record.gears, record.meshes),
        n_mountings=len(record.meshes) - 1,
    )


def test_every_gear_has_its_errors_in_its_mesh():
    record = machine(*TWO_STAGE)
    specimen = specimen_of(record)
    line = record.line(Run(system=record, specimen=specimen))
    stage = line.dynamics.teeth[1]
    names = ("idler_gear_2", OUTPUT)
    for error, tilt, name in zip(stage.errors, stage.tilts, names, strict=True):
        np.testing.assert_array_equal(error, specimen.others[name].error)
        assert np.ptp(error) > 1e-6
        np.testing.assert_array_equal(tilt, specimen.others[name].tilt)
        assert np.ptp(tilt) > 1e-5
    nominal = record.line(Run(system=record)).dynamics.teeth[1]
    assert not np.any(nominal.errors[0])
    factor = specimen.mountings[0].backlash_factor
    assert_close(stage.pair.backlash, factor * nominal.pair.backlash, 1e-9)
    # the common forms of all its teeth, tip and misalignment
    opened = stage.table.pairs.gap - nominal.table.pairs.gap
    assert np.abs(opened).max() > 1e-6


def test_errors_of_an_idler_stay_on_the_flanks_of_its_home_mesh():
    """Crank gear and small idler drive in two meshes: the same flanks. The idler is driven in one
    and drives in the other: there its other flanks have no errors.
    """
    record = machine(*ENGINE, "system.record_mesh=[3,18]")
    specimen = specimen_of(record)
    line = record.line(Run(system=record, specimen=specimen))
    errors = {
        name: mesh.errors
        for name, mesh in zip(
            record.engine.mesh_names, line.dynamics.teeth, strict=True
        )
    }
    error_of = {name: each.error for name, each in specimen.others.items()}

    np.testing.assert_array_equal(errors["3/18"][0], specimen.pinion_error)
    np.testing.assert_array_equal(errors["3/66"][0], specimen.pinion_error)
    np.testing.assert_array_equal(errors["19/20"][0], error_of["small_idler_gear"])
    np.testing.assert_array_equal(errors["19/32"][0], error_of["small_idler_gear"])
    np.testing.assert_array_equal(errors["3/66"][1], error_of["idler_gear"])
    assert not np.any(errors["66/67"][0])
    tilts = dict(
        zip(errors, (teeth.tilts for teeth in line.dynamics.teeth), strict=True)
    )
    assert not np.any(tilts["66/67"][0])
    assert np.any(tilts["66/67"][1])
    tilt = specimen.others["small_idler_gear"].tilt
    for mesh in ("19/20", "19/32"):
        np.testing.assert_array_equal(tilts[mesh][0], tilt)
    np.testing.assert_array_equal(errors["66/67"][1], error_of["lube_oil_pump_gear"])
    assert all(np.any(each[1]) for each in errors.values())


def test_a_perfect_specimen_is_none_at_all():
    record = machine(*TWO_STAGE)
    pair = record.pair
    perfect = perfect_specimen(pair.pinion, pair.wheel)
    zeros = {
        name: GearErrors(error=np.zeros(gear.n_teeth), tilt=np.zeros(gear.n_teeth))
        for name, gear in record.gears.items()
        if name not in pair.gears
    }
    named = replace(perfect, others=zeros, mountings=(Mounting(),))
    short = replace(record, operating=replace(record.operating, duration=0.05))
    signals = [
        short.simulate(specimen=specimen).acceleration
        for specimen in (None, perfect, named)
    ]
    np.testing.assert_array_equal(signals[0], signals[1])
    np.testing.assert_array_equal(signals[0], signals[2])


def test_supports_of_all_gears_scatter_with_the_gearbox():
    record = machine(*TWO_STAGE)
    quality = replace(record.quality, support_stiffness_scatter=0.2)
    gearbox = draw_gearbox(np.random.default_rng(0), 4, quality, 0.0, n_gears=4)
    nominal = record.line(Run(system=record))
    line = record.line(Run(system=record, gearbox=gearbox))
    names = [gear.name for gear in record.engine.drive.line.gears]
    at = [
        nominal.matrices.names.index(f"{name} {axis}")
        for name in names
        for axis in "xy"
    ]
    ratio = line.matrices.stiffness[at, at] / nominal.matrices.stiffness[at, at]
    assert_close(ratio, gearbox.stiffness_factor, 1e-9)
    # a gearbox that knows two gears leaves the others as they are
    two = replace(nominal_gearbox(4), stiffness_factor=gearbox.stiffness_factor[:4])
    line = record.line(Run(system=record, gearbox=two))
    ratio = line.matrices.stiffness[at, at] / nominal.matrices.stiffness[at, at]
    assert_close(ratio[:4], gearbox.stiffness_factor[:4], 1e-9)
    assert_close(ratio[4:], np.ones(4), 1e-12)


def test_several_gears_at_once_are_felt_each_in_its_mesh():
    record = machine(*TWO_STAGE)
    drive, number = record.engine.drive, record.mesh_number
    faults = crack("pinion", 1), crack(OUTPUT, 2), crack("idler_gear_2", 3)
    first = felt_there(drive, number, 0, faults)
    second = felt_there(drive, number, 1, faults)
    assert [(felt.gear, felt.tooth) for felt in first] == [("pinion", 1)]
    assert [(felt.gear, felt.tooth) for felt in second] == [("wheel", 2), ("pinion", 3)]


def test_a_gear_that_no_teeth_follow_is_refused():
    words = (*ENGINE, "system.helical_meshes=constant")
    record = machine(*words, "system.record_mesh=[21,45]")
    drive = record.engine.drive
    far = record.engine.mesh_names.index("66/67")
    assert not is_tabulated(drive, record.mesh_number, far)
    with refused("system.helical_meshes=sliced", FaultError):
        record.faulty_meshes([crack("lube_oil_pump_gear")])
    assert record.mesh_table([crack("wheel")]) is not record.mesh_table()
    with refused("'sun'; allowed: pinion, wheel, crankshaft_gear", FaultError):
        record.mesh_table([crack("sun")])
