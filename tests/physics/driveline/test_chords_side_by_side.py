"""Lines of helical meshes, and of many pairs in contact, in the two-evaluation core."""

from pathlib import Path

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

import gensig
from gensig import load_system
from gensig.dynamics.backends.nystroem import machine_lanes
from gensig.dynamics.decimation import in_band_error
from gensig.faults.broken import MissingTooth
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run, Start

SHORT = (
    "sensing.sampling_rate_hz=51200",
    "operating.duration_s=0.1",
    "operating.drive_frequency_hz=20",
)
HELICAL = (
    "experiment=two_stage",
    "system=phm09_helical_two_stage",
    "solver.oversampling=8",
    *SHORT,
)
LOSSLESS = ("system.loss_factor.shaft=0", "system.loss_factor.coupling=0")
SPUR = ("experiment=two_stage", "solver.oversampling=5", *SHORT)
MISSING = (MissingTooth(gear="pinion", tooth=3),)
CROWNED = (
    "system=helical_pair",
    "gear=xiamen_23_84",
    "mesh.n_slices=8",
    "modification.pinion.crowning_um=15",
    "operating.drive_frequency_hz=20",
    "gear.pinion.support.damping_x_ns_per_m=100",
    "gear.wheel.support.damping_x_ns_per_m=500",
)

SLANTED = (
    "system=helical_pair",
    "mesh.n_slices=8",
    "modification.pinion.crowning_um=15",
    "operating.drive_frequency_hz=20",
)


def line(*words):
    """A line machine by overrides."""
    return load_system(*words)


@pytest.mark.parametrize("words", [CROWNED, SLANTED], ids=["crowned", "helical"])
@pytest.mark.parametrize("faults", [(), MISSING], ids=["sound", "missing"])
def test_a_pair_with_chords_as_a_line_moves_as_the_pair(faults, words):
    """Crowned spur slices, and teeth that move the gears along their axes and tilt them."""
    system = load_system(*words)
    start = Start(tooth_pinion=3, tooth_wheel=5, phase=0.3)
    run = Run(system=system, faults=faults, start=start, specimen=specimen_of(system))
    pair = running_pair(run)
    assert len(pair.table.depth) > 4
    assert_moves_as_a_line(pair.dynamics, oversampling=12)  # tilts are stiff


@pytest.mark.parametrize(
    "fault", [(one("pitting", tooth=4),), MISSING], ids=["pitting", "missing"]
)
def test_spur_teeth_have_one_chord(fault, monkeypatch):
    """Followed by the core of many pairs, they move as by that of three."""
    machine = line(*SPUR)
    run = run_of(machine, fault, specimen=specimen_of(machine), with_mesh_state=True)
    (three,) = recorded(run)
    monkeypatch.setattr(machine_lanes, "MOST_CONTACT_RATIO", 0.0)
    (many,) = recorded(run)
    assert three.acceleration.tobytes() != many.acceleration.tobytes()
    found, expected = (each.acceleration[None] for each in (many, three))
    assert in_band_error(found, expected, RATE)[0] < 1e-3
    assert np.mean(many.mesh.pinion_tooth == three.mesh.pinion_tooth) > 0.995
    off = np.abs(many.mesh.force - three.mesh.force)
    assert off.max() < 0.02 * three.mesh.force.mean()


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Overrides of a gearbox whose first stage is spur and whose second is helical."""
    shipped = Path(gensig.__file__).parent.parent / "configs" / "tables"
    table = (shipped / "two_stage_gears.csv").read_text(encoding="utf-8")
    for gear in ("Idler gear 2,48", "Output gear,80"):
        assert f"{gear},2,20,0" in table
        table = table.replace(f"{gear},2,20,0", f"{gear},2,20,15")
    file = tmp_path_factory.mktemp("mixed") / "gears.csv"
    file.write_text(table, encoding="utf-8")
    return [*HELICAL, "system=two_stage_gearbox", f"system.gears_csv={file}"]


def test_a_spur_and_a_helical_stage_agree_with_the_implicit_method(mixed):
    """Without friction, which starts a free vibration of the quiet bearing that hardly decays."""
    machine = line(*mixed, *LOSSLESS, "mesh.friction_coefficient=0")
    slow = with_solver(machine, backend="newmark", oversampling=40)
    found, expected = recorded(*[run_of(each) for each in (machine, slow)])
    for ours, theirs in zip(found.acceleration, expected.acceleration, strict=True):
        off = np.linalg.norm(spectrum(ours) - spectrum(theirs))
        assert off < 0.01 * np.linalg.norm(spectrum(theirs))
