"""The verb modes from the command line: what it writes, and what it refuses in one line."""

import csv
import json
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.cli import main

KEYS = {
    "natural_frequencies_hz",
    "damping_ratio",
    "shapes",
    "kinetic_energy_share",
    "nodes",
    "speed_ratio",
}
ENGINE = "system=engine_gear_train"
HOWTO = Path(__file__).resolve().parents[3] / "docs" / "howto" / "your_drive_line.md"


def blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", page, flags=re.DOTALL)


def modes_of(tmp_path, *words):
    out = tmp_path / "modes.json"
    assert main(["modes", *words, "--json", str(out)]) == 0
    return json.loads(out.read_text())


def test_the_engine_has_the_frequencies_of_its_printed_tables(tmp_path, capsys):
    content = modes_of(tmp_path, ENGINE)
    assert set(content) >= KEYS
    frequency = content["natural_frequencies_hz"]
    assert frequency[0] == 0.0
    assert content["damping_ratio"][0] == 0.0
    assert_allclose(frequency[1:5], [28.31, 68.72, 162.06, 215.97], rtol=0, atol=0.005)
    assert len(frequency) == len(content["nodes"]) == len(content["shapes"]) == 67
    assert {
        len(row) for row in content["shapes"] + content["kinetic_energy_share"]
    } == {67}
    assert_allclose(np.sum(content["kinetic_energy_share"], axis=1), 1.0, rtol=1e-9)
    assert_allclose(np.max(np.abs(content["shapes"]), axis=1), 1.0, rtol=1e-12)
    assert_allclose(content["kinetic_energy_share"][4][15], 0.82, atol=0.005)
    assert content["speed_ratio"][44] == -0.5
    assert content["speed_ratio"][19] == 0.5
    assert content["speed_ratio"][17] == -1.0
    assert content["mesh_orders"][0] == 59.0
    assert "28.31" in capsys.readouterr().out


def test_a_pair_says_which_way_its_gears_move(capsys):
    assert main(["modes", "experiment=realistic"]) == 0
    head, _, *modes = capsys.readouterr().out.splitlines()
    assert "4 inertias, 4 lateral motions of gears" in head
    assert modes[0].endswith("turns freely")
    assert any("% wheel x" in line for line in modes)
    assert "pinion rotation" in modes[-1]
    assert modes[-1].endswith("of the strain in a mesh")


def test_lateral_motion_adds_22_masses(tmp_path):
    content = modes_of(tmp_path, ENGINE, "system.lateral=true")
    assert len(content["natural_frequencies_hz"]) == 67 + 22
    assert len(content["shapes"][0]) == 89
    assert {len(row) for row in content["kinetic_energy_share"]} == {67}
    assert content["n_rigid_modes"] == 1
    assert_allclose(
        content["natural_frequencies_hz"][1:4],
        [28.31, 68.71, 161.92],
        rtol=0,
        atol=0.01,
    )


def test_a_viscous_damper_is_an_option(tmp_path):
    content = modes_of(tmp_path, ENGINE, "system.viscous_damper_node=1")
    assert_allclose(
        content["natural_frequencies_hz"][1:5],
        [28.56, 70.36, 166.49, 215.97],
        rtol=0,
        atol=0.005,
    )


@pytest.mark.parametrize(("system", "n"), [("spur_pair", 6), ("two_stage_gearbox", 8)])
def test_other_machines_have_modes_and_figures(tmp_path, system, n):
    figure = tmp_path / "modes.png"
    content = modes_of(tmp_path, f"system={system}", "--plot", str(figure))
    assert len(content["natural_frequencies_hz"]) == n
    assert content["n_rigid_modes"] == 1
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_what_a_newcomer_types_works(tmp_path):
    content = modes_of(tmp_path, "--plot", str(tmp_path / "modes.svg"))
    assert content["system"] == "spur_pair"
    assert len(modes_of(tmp_path, "experiment=realistic")["nodes"]) == 4


def test_your_own_tables_are_read_by_their_path(tmp_path):
    tables = resources.files("gensig.configs").joinpath("tables")
    mine, gears = tmp_path / "mine.csv", tmp_path / "my gears.csv"
    text = tables.joinpath("engine_shafting.csv").read_text(encoding="utf-8")
    mine.write_text(text, encoding="utf-8")
    gears.write_text(
        tables.joinpath("engine_gears.csv").read_text(encoding="utf-8"),
        encoding="utf-8",
    )
    words = [
        "system=shaft_line",
        f"system.shafting_csv={mine}",
        f"system.gears_csv='{gears}'",
    ]
    one, other = modes_of(tmp_path, *words), modes_of(tmp_path, ENGINE)
    assert_allclose(
        one["natural_frequencies_hz"], other["natural_frequencies_hz"], rtol=0, atol=0
    )


def test_the_page_on_your_own_line_runs_as_it_stands(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = HOWTO.read_text(encoding="utf-8")
    mine = tmp_path / "mine"
    (mine / "system").mkdir(parents=True)
    line, gears = blocks(page, "csv")
    option, *_ = blocks(page, "yaml")
    (mine / "line.csv").write_text(line, encoding="utf-8")
    (mine / "gears.csv").write_text(gears, encoding="utf-8")
    (mine / "system" / "my_gearbox.yaml").write_text(option, encoding="utf-8")
    command, *_ = blocks(page, "sh")  # the others run in tests/pipeline/records
    assert main(command.replace("\\\n", " ").split()[1:]) == 0
    found = json.loads((tmp_path / "modes.json").read_text())
    assert len(found["natural_frequencies_hz"]) == 6
    assert (tmp_path / "modes.png").stat().st_size > 1000
    words = ["system=my_gearbox", "--config-dir", "mine"]
    assert modes_of(tmp_path, *words)["system"] == "my_gearbox"
    (code,) = blocks(page, "python")
    capsys.readouterr()
    exec(compile(code, "your_drive_line.md", "exec"), {})
    assert "94.59" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("node", "column", "value"),
    [
        ("9", "inertia_kg_m2", "-1.507"),
        ("17", "edge_to", "68"),
        ("17", "teeth_to", "60"),
        ("20", "speed_ratio", "0.6"),
        ("31", "edge_kind", ""),
        ("50", "stiffness_mnm_per_rad", ""),
        ("54", "node", "53"),
    ],
)
def test_a_spoilt_table_names_row_and_column(tmp_path, capsys, node, column, value):
    text = (
        resources.files("gensig.configs")
        .joinpath("tables/engine_shafting.csv")
        .read_text(encoding="utf-8")
    )
    lines = text.splitlines()
    notes = [line for line in lines if line.startswith("#")]
    rows = list(csv.DictReader(lines[len(notes) :]))
    next(row for row in rows if row["node"] == node)[column] = value
    spoilt = tmp_path / "spoilt.csv"
    with spoilt.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    assert main(["modes", ENGINE, f"system.shafting_csv={spoilt}"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"row {int(node) + 1}" in error
    assert f"column {column}" in error


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["modes", "system=shaft_line"],
            "system.shafting_csv is required: give a path, or one of engine_gears.csv",
        ),
        (
            ["modes", ENGINE, "system.gears_csv=null"],
            "gear_mesh needs a table of gears; give system.gears_csv",
        ),
        (
            ["modes", ENGINE, "system.shafting_csv=engine_gears"],
            "column face_width_mm: unknown",
        ),
        (["modes", ENGINE, "system.viscous_damper_node=99"], "has no such node"),
        (["modes", "fault=crack"], "modes are those of sound teeth"),
        (["modes", "--plot", "modes.txt"], "the name must end in .png"),
        (["generate", ENGINE, "out=never"], "no excitation is chosen"),
        (["plan", ENGINE], "no excitation is chosen"),
        (["simulate", "system=two_stage_gearbox"], "no excitation is chosen"),
        (["stiffness", ENGINE], "no excitation is chosen"),
        (["transmission-error", ENGINE], "is a drive line from tables"),
        (["modify-flank", ENGINE, "--out", "best.yaml"], "is a drive line from tables"),
    ],
)
def test_mistakes_are_one_line(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
