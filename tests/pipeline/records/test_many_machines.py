"""Sets whose units differ in their gears: made, verified, read, streamed and exported."""

import json
import shutil

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import gensig
from gensig.cli import main
from gensig.dataset.columns import GEAR_COLUMNS
from gensig.dataset.folder.verify import verify
from gensig.errors import DatasetError
from gensig.record.inputs import InputReader

MANY = (
    "experiment=many_machines",
    "plan.n_records=8",
    "plan.n_units=4",
    "plan.classes=[healthy,crack]",
    "plan.n_reference=1",
    "operating.duration_s=0.05",
    "solver.precision=float32",
    "dataset.records_per_shard=5",
)
ONE = (
    "plan.n_records=2",
    "plan.n_units=1",
    "plan.classes=[healthy]",
    "operating.duration_s=0.02",
    "sensing.channels=[pinion_y]",
)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    out = tmp_path_factory.mktemp("many") / "data"
    with gensig.generate(*MANY, "executor.n_workers=1", out=out) as data:
        yield data


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    out = tmp_path_factory.mktemp("one") / "data"
    with gensig.generate(*ONE, "executor.n_workers=1", out=out) as data:
        yield data


def test_a_set_of_many_designs_is_whole_and_of_version_2(many):
    assert verify(many.folder).complete
    assert many.usable.all()
    assert many.manifest.schema_version == many.attributes["schema_version"] == 2
    assert not set(GEAR_COLUMNS) & set(many.attributes)


def test_columns_are_the_geometry_of_each_machine(many):
    reader = InputReader(gensig.stream(*MANY).config)
    for index in range(many.n_records):
        pair = reader.inputs(many.plan.record(index)).machine.pair
        values = {name: many.column(name)[index] for name in GEAR_COLUMNS}
        assert values["n_teeth_pinion"] == pair.pinion.n_teeth
        assert values["n_teeth_wheel"] == pair.wheel.n_teeth
        expected = (1e3 * pair.pinion.normal_module, 1e3 * pair.center_distance)
        stored = (values["normal_module_mm"], values["center_distance_mm"])
        assert_allclose(stored, expected, rtol=1e-12)
        assert values["transverse_contact_ratio"] == pair.transverse_contact_ratio
        ratio = (
            many.column("mesh_frequency_hz")[index]
            * 60.0
            / many.column("speed_rpm")[index]
        )
        assert_allclose(ratio, pair.pinion.n_teeth, rtol=1e-12)


def test_teeth_of_records(many, one):
    teeth = many.n_teeth("pinion")
    units = many.column("unit_id")
    assert len(set(teeth.tolist())) > 1
    assert all(len(set(teeth[units == unit])) == 1 for unit in set(units))
    assert one.n_teeth("wheel").tolist() == [84, 84]
    for data in (many, one):
        with refused("neither a column nor an attribute n_teeth_motor", DatasetError):
            data.n_teeth("motor")


def test_a_stream_has_the_same_bits_and_teeth(many):
    stream = gensig.stream(*MANY)
    examples = np.flatnonzero(~many.is_reference)
    for gear in ("pinion", "wheel"):
        assert_array_equal(stream.n_teeth(gear), many.n_teeth(gear)[examples])
    for index, record in zip(examples.tolist(), stream, strict=True):
        assert_array_equal(record.signals["acceleration"], many.signals(index))
    assert gensig.stream(*ONE).n_teeth("pinion").tolist() == [23, 23]
    with refused("there are pinion, wheel", DatasetError):
        gensig.stream(*ONE).n_teeth("motor")


def test_a_set_of_one_design_is_of_version_1(one):
    assert one.manifest.schema_version == one.attributes["schema_version"] == 1
    assert set(GEAR_COLUMNS) <= set(one.attributes)
    assert not set(GEAR_COLUMNS) & set(one.column_names)


def test_cards_give_the_range_of_the_designs(many):
    text = (many.folder / "README.md").read_text()
    teeth = many.n_teeth("pinion")
    assert "| designs of gears | 4 |" in text
    assert f"| n_teeth_pinion | {teeth.min()} to {teeth.max()} |" in text
    biases = json.loads((many.folder / "croissant.json").read_text())["rai:dataBiases"]
    assert any("in 4 designs: " in line for line in biases)


def test_exports_and_the_page_have_the_columns(many, tmp_path):
    out = tmp_path / "set.npz"
    assert main(["export", str(many.folder), "--to", "npz", "--out", str(out)]) == 0
    with np.load(out) as arrays:
        for name in GEAR_COLUMNS:
            assert_array_equal(arrays[name], many.column(name))
    page = tmp_path / "page.html"
    assert main(["report", str(many.folder), "--records", "1", "--out", str(page)]) == 0
    assert "designs of gears" in page.read_text()


def test_a_manifest_of_another_version_is_refused(many, tmp_path):
    folder = shutil.copytree(many.folder, tmp_path / "copy")
    path = folder / "manifest.json"
    path.write_text(
        path.read_text().replace('"schema_version": 2', '"schema_version": 1')
    )
    with refused("manifest.json was altered", DatasetError):
        gensig.open_dataset(folder)
    problems = verify(folder).problems
    assert any("has format version 2, the manifest says 1" in line for line in problems)
