"""The verb tune-damper from the command line: what it writes, and what it refuses in one line."""

import json

import pytest
from numpy.testing import assert_allclose

from gensig.cli import main

ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
PUMP = (*ENGINE, "--mesh", "21", "45")
DAMPER = "{node: %s, ring_inertia_kg_m2: %s, damping_nms_per_rad: %s, stiffness_nm_per_rad: %s}"


def test_it_writes_an_option_that_the_line_takes(tmp_path, capsys):
    (tmp_path / "system").mkdir()
    out, figure, report = (
        tmp_path / "system" / "damped.yaml",
        tmp_path / "dampers.png",
        tmp_path / "dampers.json",
    )
    words = (
        *PUMP,
        "--nodes",
        "45",
        "--viscous",
        "--run",
        "1650",
        "1750",
        "50",
        "--most-inertia",
        "0.02",
    )
    files = ("--out", str(out), "--json", str(report), "--plot", str(figure))
    assert main(["tune-damper", *words, *files]) == 0
    content = json.loads(report.read_text())
    assert content["mesh"] == "21/45"
    assert content["run_speeds_rpm"] == pytest.approx([1650, 1700, 1750])
    assert content["after"]["worst_force_n"] < content["before"]["worst_force_n"]
    (damper,) = content["dampers"]
    assert damper["node"] == 45
    assert damper["ring_inertia_kg_m2"] <= 0.02
    assert damper["stiffness_nm_per_rad"] == 0.0
    assert 0.0 < content["root_stress_drop"] < 1.0
    assert figure.stat().st_size > 50_000
    assert "safety, paper" in capsys.readouterr().out

    taken = tmp_path / "response.json"
    words = (
        "system=damped",
        "excitation=engine_v20",
        "--config-dir",
        str(tmp_path),
        "--json",
        str(taken),
    )
    assert main(["forced-response", *words]) == 0
    response = json.loads(taken.read_text())
    drive = response["meshes"].index("21/45")
    assert_allclose(
        response["greatest_tooth_force_n"][drive],
        content["after"]["greatest_force_n"],
        rtol=1e-6,
    )
    assert response["node_numbers"][-1] == 68
    assert main(["modes", "system=damped", "--config-dir", str(tmp_path)]) == 0
    assert "2 rigid mode(s)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            (*ENGINE, "--mesh", "21", "44"),
            "nodes 21 and 44 do not mesh; these do: 3/18",
        ),
        ((*PUMP, "--nodes", "99"), "the shaft line has no node 99; it has 1 to 67"),
        (
            (*PUMP, "--nodes", "45", "45"),
            "dampers on nodes 45, 45: name each node once",
        ),
        (
            (*PUMP, "--run", "900", "700", "10"),
            "--run 900 700 10: give low, high and step",
        ),
        (
            (*PUMP, "--most-inertia", "0", "--run", "1700", "1750", "50"),
            "give a positive one for each damper",
        ),
        ((*PUMP, "--plot", "a.txt"), "--plot a.txt: the name must end in .png"),
        (
            (*PUMP, "excitation.pressure.file=none.csv"),
            "excitation.pressure.file is of one operating point",
        ),
        (
            ("excitation=engine_v20", "--mesh", "1", "2"),
            "system.kind = 'spur_pair' is no drive line",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, message, tmp_path, capsys):
    assert main(["tune-damper", *words, "--out", str(tmp_path / "damped.yaml")]) == 2
    printed = capsys.readouterr().err.strip().splitlines()
    assert message in printed[-1]
    assert not (tmp_path / "damped.yaml").exists()


def test_a_name_that_is_no_option_is_refused(capsys):
    assert main(["tune-damper", *PUMP, "--out", "my damper.yaml"]) == 2
    assert "give a file NAME.yaml in a folder system" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("dampers", "message"),
    [
        ("5", "system.dampers = 5 must be a list of dampers, [] for none"),
        ("[7]", "system.dampers[0] = 7 must be a group of keys"),
        (
            f"[{DAMPER % (99, 0.01, 1, 0)}]",
            "system.dampers: node 99 is not in the shaft line; it has 1 to 67",
        ),
        (
            f"[{DAMPER % (45, 0, 1, 0)}]",
            "system.dampers[0].ring_inertia_kg_m2 = 0 must be positive",
        ),
        (
            f"[{DAMPER % (45, 0.01, -1, 0)}]",
            "system.dampers[0].damping_nms_per_rad = -1 must not be negative",
        ),
        (
            f"[{DAMPER % (45, 0.01, 0, 0)}]",
            "system.dampers[0]: without damping and stiffness nothing holds the ring",
        ),
        (f"[{DAMPER % ('crank', 0.01, 1, 0)}]", "system.dampers[0].node"),
        ("[{node: 45, ring_inertia_kg_m2: 0.01}]", "system.dampers[0]"),
        ("[{node: 45, mass_kg: 1}]", "system.dampers[0]"),
    ],
)
def test_ill_dampers_are_refused_in_one_line(dampers, message, capsys):
    assert main(["modes", "system=engine_gear_train", f"system.dampers={dampers}"]) == 2
    printed = capsys.readouterr().err.strip()
    assert message in printed
    assert "\n" not in printed
