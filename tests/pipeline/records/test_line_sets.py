"""Small data sets of drive lines through every verb: two engine meshes and a two-stage gearbox."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from record_sets import check_labels, run, shard, texts

from gensig.dataset.folder.layout import PLAN
from gensig.dataset.plan import PlanRows
from gensig.dataset.reader import open_dataset
from gensig.errors import DatasetError
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record
from gensig.report.rotation_frequencies import read_rotation

ENGINE = (
    "experiment=engine_broken_tooth",
    "operating.duration_s=0.05",
    "plan.n_records=4",
    "plan.n_units=1",
)
TWO_STAGE = (
    "experiment=two_stage",
    "operating.duration_s=0.1",
    "plan.n_records=10",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
)


@dataclass(frozen=True)
class Line:
    """Words of a set, and what its file must say.

    ``teeth`` of the driving and the driven gear; ``faulty`` those of the gears that may have a
    fault, by name; ``ratio`` of the driving shaft's speed to the set one; ``report`` is in the
    output of ``inspect``, ``check`` that of the integration.
    """

    words: tuple[str, ...]
    classes: tuple[str, ...]
    teeth: tuple[int, int]
    faulty: dict[str, int]
    ratio: float
    units: tuple[str, ...]
    report: str
    check: str = "energy"


LINES = {
    # the driving shaft of the mesh is the camshaft, at half the crank's speed
    "engine": Line(
        words=ENGINE,
        classes=("broken", "crack", "healthy", "missing_tooth"),
        teeth=(54, 54),
        faulty={"wheel": 54},
        ratio=0.5,
        units=("rad/s", "rad/s", "rad/s^2", "rad/s^2"),
        report="flywheel_speed, pump_end_speed",
    ),
    # the crank gear drives an idler
    "engine_helical": Line(
        words=(
            *ENGINE,
            "system.record_mesh=[3,66]",
            "mesh.n_slices=12",
            "mesh.points_per_pitch=128",
            "plan.classes=[healthy,crack,broken,chipped]",
        ),
        classes=("broken", "chipped", "crack", "healthy"),
        teeth=(59, 68),
        faulty={"wheel": 68},
        ratio=1.0,
        units=("rad/s", "rad/s", "rad/s^2", "rad/s^2"),
        report="flywheel_speed, pump_end_speed",
    ),
    "two_stage": Line(
        words=(*TWO_STAGE, "system.record_mesh=[5,6]", "fault.gear=wheel"),
        classes=("broken", "crack", "healthy", "missing_tooth", "pitting"),
        teeth=(48, 80),
        faulty={"wheel": 80},
        ratio=1.0 / 3.0,
        units=("m/s^2",) * 4,
        check="error",
        report="of the load, as the motor feels it",
    ),
    "any_gear": Line(
        words=TWO_STAGE,
        classes=("broken", "crack", "healthy", "missing_tooth", "pitting"),
        teeth=(32, 96),
        faulty={"pinion": 32, "wheel": 96, "idler_gear_2": 48, "output_gear": 80},
        ratio=1.0,
        units=("m/s^2",) * 4,
        check="error",
        report="pinion 32, wheel 96, idler_gear_2 48, output_gear 80 teeth",
    ),
    # the gear's name has more than the 16 bytes that a gear pair's column has
    "pump": Line(
        words=(
            *ENGINE,
            "fault.gear=fresh_water_pump_gear",
            "mesh.n_slices=12",
            "mesh.points_per_pitch=128",
        ),
        classes=("broken", "crack", "healthy", "missing_tooth"),
        teeth=(54, 54),
        faulty={"fresh_water_pump_gear": 41},
        ratio=0.5,
        units=("rad/s", "rad/s", "rad/s^2", "rad/s^2"),
        report="faults on    fresh_water_pump_gear 3 records",
    ),
}


@dataclass(frozen=True)
class Made:
    line: Line
    folder: Path

    def row_of(self, name):
        rows = PlanRows(self.folder / PLAN).records(0, len(self.line.classes))
        return next(row for row in rows if row["label_name"] == name)

    def stored(self, row):
        with shard(self.folder) as file:
            return file["acceleration"][int(row["row"])]


@pytest.fixture(scope="module", params=LINES)
def made(request, tmp_path_factory):
    line = LINES[request.param]
    folder = tmp_path_factory.mktemp(request.param) / "set"
    run("generate", *line.words, f"out={folder}")
    return Made(line, folder)


def test_a_set_is_whole_and_comes_again(made, capsys):
    run("verify", made.folder)
    run("reproduce", made.folder, "--records", 1)
    capsys.readouterr()
    run("inspect", made.folder)
    assert made.line.report in capsys.readouterr().out
    if "torque" in made.line.report:
        assert f"{made.line.report} |" in (made.folder / "README.md").read_text()


def test_labels_units_and_columns_name_gear_tooth_and_shaft(made):
    line = made.line
    with shard(made.folder) as file:
        check_labels(file, line.classes, line.faulty)
        assert texts(file.attrs["channel_units"]) == list(line.units)
        assert set(texts(file["integration_check"][:])) == {line.check}
        set_speed = file["params/operating.speed_rpm"][:]
        assert_allclose(file["speed_set_rpm"][:], line.ratio * set_speed)
        mesh = line.teeth[0] * file["speed_rpm"][:] / 60
        assert_allclose(file["mesh_frequency_hz"][:], mesh)


def test_a_record_depends_on_its_row_alone_and_a_sham_has_no_fault(made):
    config = read_request([*made.line.words]).config
    row = made.row_of("broken")
    again = simulate_record(InputReader(config), row).signals["acceleration"]
    assert_array_equal(again, made.stored(row))
    without = config.with_keys("plan", sham=True)
    faulty = [made.row_of(name) for name in made.line.classes if name != "healthy"]
    # in so short a record some of the faulty teeth never come into mesh
    assert any(
        not np.array_equal(
            simulate_record(InputReader(without), row).signals["acceleration"],
            made.stored(row),
        )
        for row in faulty
    )


def test_readers_know_all_gears_of_a_line(made):
    with open_dataset(made.folder) as data:
        names = list(data.attributes["gear_names"])
        for gear, n_teeth in made.line.faulty.items():
            assert set(data.n_teeth(gear)) == {n_teeth}
        assert set(data.column("fault_gear")) <= {"", *made.line.faulty}
        rotation = read_rotation(data)
        for gear, turns in zip(
            names, data.attributes["gear_pinion_turns"], strict=True
        ):
            assert_allclose(rotation.turns(gear) * turns, rotation.drive, rtol=1e-9)
        index = int(np.flatnonzero(data.column("fault_gear") != "")[0])
        gear = rotation.fault_gear(index)
        assert rotation.of(index)[gear] > 0.0
        with pytest.raises(DatasetError, match="n_teeth_sun"):
            data.n_teeth("sun")
