"""Flank modifications of a drive line: those of a pair, on the flanks that work in its mesh."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fault_cases import side_of
from numpy.testing import assert_allclose

from gensig import configs, load_system
from gensig.driveline.teeth import modified_there
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.modification import FlankModification
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.sliced_pair import SlicedPair

TABLES = Path(configs.__file__).parent / "tables"
SHORT = ("operating.duration_s=0.02", "mesh.points_per_pitch=64", "mesh.n_slices=6")
RELIEF = (
    "modification.pinion.tip_relief_um=12",
    "modification.pinion.tip_relief_height_mm=1.5",
    "modification.wheel.tip_relief_um=9",
    "modification.wheel.tip_relief_height_mm=1.2",
    "modification.wheel.crowning_um=4",
)


def line(*words):
    return load_system(*SHORT, *words)


def assert_same_tables(one, other):
    assert_allclose(
        side_of(one, "pinion").compliance,
        side_of(other, "pinion").compliance,
        rtol=1e-12,
    )
    assert_allclose(
        side_of(one, "pinion").gap, side_of(other, "pinion").gap, atol=1e-18
    )
    assert_allclose(side_of(one, "wheel").gap, side_of(other, "wheel").gap, atol=1e-18)


def test_spur_teeth_are_those_of_a_pair():
    machine = line("system=two_stage_gearbox", *RELIEF)
    pair = load_system(*SHORT)
    pair = replace(
        pair,
        pair=machine.pair,
        material=machine.material,
        mesh=machine.mesh,
        modification=machine.modification,
        operating=replace(
            pair.operating,
            torque=machine.mesh_force * machine.pair.pinion.base_radius,
        ),
    )
    assert isinstance(pair, GearPairMachine)
    assert_same_tables(machine.mesh_table(), pair.mesh_table())


def test_helical_teeth_are_those_of_a_pair():
    machine = line("system=phm09_helical_two_stage", *RELIEF)
    pair = SlicedPair(
        pair=machine.pair,
        material=machine.material,
        mesh=machine.mesh,
        slices=machine.slices,
        modification=machine.modification,
        torque=machine.mesh_force * machine.pair.pinion.base_radius,
    )
    ours, theirs = machine.mesh_table(), pair.mesh_table()
    assert_allclose(ours.pairs.gap, theirs.pairs.gap, atol=1e-18)
    assert_allclose(ours.pairs.compliance, theirs.pairs.compliance, rtol=1e-12)


def test_long_reliefs_of_a_stage_even_its_transmission_error():
    """Welbourn's long reliefs for the force of the mesh, cut on the line's gears."""
    plain = line("system=two_stage_gearbox")
    pair = load_system(*SHORT)
    torque = plain.mesh_force * plain.pair.pinion.base_radius
    pair = replace(
        pair, pair=plain.pair, operating=replace(pair.operating, torque=torque)
    )
    relieved = replace(plain, modification=pair.long_relief())
    ripples = [
        ripple(machine.mesh_table(), machine.mesh_force)
        for machine in (plain, relieved)
    ]
    assert ripples[1] < 0.2 * ripples[0]


def ripple(table, force):
    """Static transmission error over a pitch, peak to peak in m."""
    assert table.is_separable
    roll = np.linspace(0.0, table.pair.base_pitch, 200, endpoint=False)
    approach = static_mesh(table, pair_states(table, roll), force).approach
    return float(np.ptp(approach))


@pytest.mark.parametrize(
    ("followed", "other", "pinion", "wheel"),
    [
        ("[3,18]", "3/66", True, False),  # the crankshaft's gear drives both
        ("[19,20]", "19/32", True, False),
        ("[19,20]", "20/43", False, False),  # an idler drives with its other flanks
        ("[21,45]", "19/20", False, False),
    ],
)
def test_other_meshes_meet_the_same_flanks_or_others(followed, other, pinion, wheel):
    machine = line(
        "system=engine_gear_train",
        f"system.record_mesh={followed}",
        "system.helical_meshes=constant",
        *RELIEF,
        "modification.misalignment_um=10",
    )
    number = machine.engine.mesh_names.index(other)
    there = modified_there(
        machine.engine.drive, machine.mesh_number, number, machine.modification
    )
    plain = FlankModification()
    assert there.pinion == (machine.modification.pinion if pinion else plain)
    assert there.wheel == (machine.modification.wheel if wheel else plain)
    assert there.misalignment == 0.0
    assert machine.modification.misalignment == pytest.approx(10e-6)


@pytest.fixture
def relieved_by_table(tmp_path):
    """The two-stage gearbox with tip reliefs in its table of gears; overrides follow."""
    shipped = (TABLES / "two_stage_gears.csv").read_text(encoding="utf-8")
    rows = [text for text in shipped.splitlines() if not text.startswith("#")]
    lines = [f"{rows[0]},tip_relief_um,tip_relief_height_mm"]
    for number, row in enumerate(rows[1:], start=1):
        lines.append(f"{row},{3 * number},1.{number}")
    file = tmp_path / "gears.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def make(*words):
        return line("system=two_stage_gearbox", f"system.gears_csv={file}", *words)

    return make


def test_reliefs_of_the_table_are_those_of_an_option(relieved_by_table):
    """In the followed mesh the same tables as the same reliefs of the group."""
    words = [
        "modification.pinion.tip_relief_um=3",
        "modification.pinion.tip_relief_height_mm=1.1",
        "modification.wheel.tip_relief_um=6",
        "modification.wheel.tip_relief_height_mm=1.2",
    ]
    by_option = line("system=two_stage_gearbox", *words)
    by_table = relieved_by_table()
    assert_same_tables(by_table.mesh_table(), by_option.mesh_table())
    assert by_table.modified(0) == by_option.modified(0)


def test_every_mesh_has_the_reliefs_of_its_gears(relieved_by_table):
    machine = relieved_by_table()
    depths = [
        [side.tip_relief for side in machine.modified(number).sides.values()]
        for number in range(2)
    ]
    assert_allclose(depths, [[3e-6, 6e-6], [9e-6, 12e-6]])
    # seen from a gear of the other mesh too
    other, _ = machine.at_gear("output_gear")
    assert other.mesh_number == 1
    for number in range(2):
        assert other.modified(number) == machine.modified(number)


def test_an_option_stands_for_the_table_in_the_followed_mesh_only(relieved_by_table):
    machine = relieved_by_table("modification.pinion.crowning_um=4")
    followed, other = machine.modified(0), machine.modified(1)
    assert followed.pinion == FlankModification(crowning=4e-6)
    assert followed.wheel == FlankModification()
    assert other.pinion.tip_relief == pytest.approx(9e-6)
