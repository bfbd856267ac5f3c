"""The verb new: what it derives, what it writes, that the commands it prints work, and what it refuses."""

import io
import json
import math
import re
import shlex
import sys

import pytest
import yaml
from docs_pages import ROOT, blocks, command_lines
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.commands.new.data_sheet import DataSheet, gear_option, least_backlash
from gensig.plan.request import read_request
from gensig.systems.root_strength import read_root_strength
from gensig.text.option_writing import is_option_name

SHEET = ("--teeth", "20", "45", "--module", "3", "--speed", "1500", "--torque", "60")


def sheet(**changes) -> DataSheet:
    return DataSheet(
        **{
            "name": "a",
            "teeth": (20, 45),
            "module": 3.0,
            "speed": 1500.0,
            "torque": 60.0,
            **changes,
        }
    )


def test_masses_are_those_of_steel_discs_with_bores():
    option = gear_option(sheet(widths=(30.0, 28.0), bores=(24.0, 40.0)))
    for body, radius, bore, width in (
        (option.machine.pinion, 0.030, 0.012, 0.030),
        (option.machine.wheel, 0.0675, 0.020, 0.028),
    ):
        mass = (
            option.machine.material.density_kg_per_m3
            * math.pi
            * (radius**2 - bore**2)
            * width
        )
        assert_allclose(body.mass, mass, rtol=1e-12, atol=0.0)
        assert_allclose(
            body.inertia, 0.5 * mass * (radius**2 + bore**2), rtol=1e-12, atol=0.0
        )


def test_a_gearbox_twice_as_large_scales_as_it_should():
    one, two = gear_option(sheet()), gear_option(sheet(module=6.0, torque=480.0))
    assert_allclose(
        two.derived()["center_distance_mm"],
        2.0 * one.derived()["center_distance_mm"],
        rtol=1e-12,
        atol=0,
    )
    assert_allclose(
        two.machine.pinion.mass, 8.0 * one.machine.pinion.mass, rtol=1e-9, atol=0.0
    )
    assert_allclose(
        two.pair.transverse_contact_ratio,
        one.pair.transverse_contact_ratio,
        rtol=1e-12,
        atol=0.0,
    )
    assert (
        two.machine.pinion.support.stiffness_y > one.machine.pinion.support.stiffness_y
    )


def test_backlash_is_that_of_the_printed_rule():
    assert least_backlash(100.0, 5.0) == pytest.approx(
        173.3, abs=0.05
    )  # 2/3 (0.06 + 0.05 + 0.15) mm


def test_every_value_of_the_option_has_a_remark_and_the_given_ones_are_kept(
    tmp_path, capsys
):
    more = (
        "--widths",
        "25",
        "--bores",
        "22",
        "40",
        "--supports",
        "1e8",
        "--profile-shifts",
        "0.2",
        "-0.1",
    )
    assert (
        main(
            ["new", "gearbox", "mine", *SHEET, *more, "--dir", str(tmp_path), "--json"]
        )
        == 0
    )
    text = (tmp_path / "gear" / "mine.yaml").read_text()
    gear = yaml.safe_load(text)
    assert [gear[side]["face_width_mm"] for side in ("pinion", "wheel")] == [25.0, 25.0]
    assert [gear[side]["bore_radius_mm"] for side in ("pinion", "wheel")] == [
        11.0,
        20.0,
    ]
    assert [gear[side]["profile_shift"] for side in ("pinion", "wheel")] == [0.2, -0.1]
    assert gear["wheel"]["support"]["stiffness_x_n_per_m"] == 1e8
    bare = [
        line
        for line in text.splitlines()
        if ": " in line and "#" not in line and "name:" not in line
    ]
    assert bare == []
    derived = json.loads(capsys.readouterr().out)["derived"]
    assert derived["mesh_frequency_hz"] == 500.0
    assert 1.2 < derived["transverse_contact_ratio"] < 2.0


DOUBTS = {
    "--torque 55000": "root stress of .* MPa: no steel bears more than about 1000; are --torque in N m",
    "--torque 0.055": "gears that do no work",
    "--speed 24.5": "is it r/min, not Hz",
    "--speed 90000": "pitch line speed of 283 m/s, outside 0.05 to 60",
    "--widths 0.025": "the wheel is 0.00833 modules wide",
    "--torque 90": None,
}


@pytest.mark.parametrize("words", DOUBTS)
def test_another_unit_is_said_loudly(words, tmp_path, capsys):
    assert (
        main(["new", "gearbox", "mine", *SHEET, *words.split(), "--dir", str(tmp_path)])
        == 0
    )
    said = capsys.readouterr().err
    assert said == "" if DOUBTS[words] is None else re.search(DOUBTS[words], said)


def test_what_follows_is_that_of_the_textbook():
    told = gear_option(sheet(widths=(30.0, 28.0))).derived()
    assert_allclose(told["wheel_speed_rpm"], 1500.0 * 20 / 45, rtol=1e-12, atol=0.0)
    assert_allclose(told["wheel_torque_nm"], 60.0 * 45 / 20, rtol=1e-12, atol=0.0)
    assert_allclose(told["power_kw"], 60.0 * 1500.0 / 9549.3, rtol=1e-5, atol=0.0)
    assert_allclose(
        told["pitch_line_speed_m_per_s"],
        1500.0 / 60.0 * math.pi * 0.060,
        rtol=1e-12,
        atol=0.0,
    )
    assert_allclose(
        told["tooth_force_per_width_n_per_mm"], 2000.0 / 28.0, rtol=1e-12, atol=0.0
    )


def test_the_root_stress_is_that_of_the_verb(tmp_path, capsys):
    words = ["new", "gearbox", "mine", *SHEET, "--dir", str(tmp_path), "--json"]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)["derived"]["nominal_root_stress_mpa"]
    system = read_root_strength(read_request(["gear=mine"], config_dir=tmp_path).config)
    assert_allclose(
        told, system.gears()[system.decisive].nominal * 1e-6, rtol=1e-9, atol=0.0
    )


MEASURED = next(
    block.code
    for block in blocks((ROOT / "docs/howto/your_gearbox.md").read_text())
    if "realistic" in block.code
)


def test_the_measured_one_of_the_page_prints_what_the_page_shows(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    pages = list(blocks((ROOT / "docs/howto/your_gearbox.md").read_text()))
    place = next(k for k, block in enumerate(pages) if block.code == MEASURED)
    ((_, words),) = command_lines(f"```sh\n{MEASURED}\n```")
    assert main(words[1:]) == 0
    assert capsys.readouterr().out.strip() == pages[place + 1].code.strip()
    text = (tmp_path / "configs/experiment/reducer.yaml").read_text()
    values = [
        line
        for line in text.splitlines()
        if re.search(r": \S", line) and not line.lstrip().startswith(("#", "-"))
    ]
    assert [
        line
        for line in values
        if not re.search(r"# (given|derived|assumed|about|whole)", line)
    ] == []
    config = read_request(["experiment=reducer"], config_dir="configs").config
    assert (config["sensing"]["sampling_rate_hz"], config["sensing"]["sensors"]) == (
        25600,
        ["housing"],
    )
    assert config["sensing"]["path"]["natural_frequency_hz"] == [300, 10000]
    assert config["plan"]["classes"] == [
        "healthy",
        "crack",
        "pitting",
        "missing_tooth",
        "wear",
    ]
    assert config["plan"]["vary"]["operating.torque_nm"] == {
        "distribution": "uniform",
        "low": 27.5,
        "high": 55,
    }
    ((_, plan),) = command_lines(f"```sh\n{pages[place + 2].code}\n```")
    assert main(plan[1:]) == 0
    printed = capsys.readouterr().out
    assert [
        line
        for line in pages[place + 3].code.strip().splitlines()
        if line not in printed
    ] == []


REALISTIC = (
    "--experiment",
    "realistic",
    "--rate",
    "16000",
    "--classes",
    "healthy",
    "wear",
)


@pytest.mark.parametrize(
    "helix",
    [(), ("--helix", "20"), REALISTIC, ("--helix", "20", *REALISTIC)],
    ids=["spur", "helical", "measured", "helical measured"],
)
def test_the_printed_commands_work_as_printed(helix, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "gearbox", "mine", *SHEET, *helix]) == 0
    printed = capsys.readouterr().out.partition("next:\n")[2].splitlines()
    simulate, generate, report = (shlex.split(line)[1:] for line in printed)
    cheap = ["operating.duration_s=0.1", "mesh.n_slices=8"]
    assert main([*simulate, *cheap]) == 0
    said = capsys.readouterr().out.partition("mesh frequency ")[2]
    assert float(said.split()[0]) == pytest.approx(
        500.0, rel=2e-2 if "realistic" in helix else 1e-3
    )  # speed that wanders
    assert (tmp_path / "mine.png").stat().st_size > 10_000
    assert (
        main(
            [
                *generate,
                *cheap,
                "plan.n_records=10",
                "plan.n_units=2",
                "executor.n_workers=1",
            ]
        )
        == 0
    )
    assert main(report) == 0
    assert main(["verify", "runs/mine"]) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("mine",), "missing --teeth, --module, --speed, --torque"),
        (("../mine", *SHEET), "cannot be the name of a gearbox"),
        (("null", *SHEET), "cannot be the name of a gearbox"),
        (("xiamen_23_84", *SHEET), "comes with gensig"),
        (("mine", *SHEET, "--teeth", "9", "40"), "undercut; use at least"),
        (
            ("mine", *SHEET, "--bores", "60", "60"),
            "bore_radius_mm = 30 must lie between 0 and the root radius",
        ),
        (("mine", *SHEET, "--bores", "2"), "thinner than any bearing"),
        (("mine", *SHEET, "--module", "-1"), "--module -1 must be positive"),
        (
            ("mine", *SHEET, "--module", "0.0025"),
            "--module 0.0025 must lie in 0.1 to 50: it is in mm",
        ),
        (
            ("mine", *SHEET, "--classes", "healthy", "worn"),
            "no option 'worn' of fault; did you mean 'wear'?",
        ),
        (("mine", *SHEET, "--sensors", "top"), "add --experiment realistic"),
        (
            ("mine", *SHEET, "--speed-range", "1400", "1500"),
            "give shares of the rated value",
        ),
        (("mine", *SHEET, "--rate", "1000"), "above the usable band of 390.6 Hz"),
        (("mine", *SHEET, "--grade", "20"), "quality.iso1328_grade = 20 must lie in"),
        (
            ("mine", *SHEET, "--widths", "1", "2", "3"),
            "--widths takes one number for both gears, or two",
        ),
        (("mine", *SHEET, "--helix", "60"), "helix_angle_deg"),
    ],
)
def test_what_makes_no_gearbox_is_refused_in_one_line(
    words, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    assert main(["new", "gearbox", *words, "--dir", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err.strip().splitlines()[-1]
    assert not list(tmp_path.rglob("*.yaml"))


def test_nothing_is_overwritten(tmp_path, capsys):
    words = ["new", "gearbox", "mine", *SHEET, "--dir", str(tmp_path)]
    assert main(words) == 0
    before = (tmp_path / "gear" / "mine.yaml").read_bytes()
    assert main([*words, "--torque", "90"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert (tmp_path / "gear" / "mine.yaml").read_bytes() == before


def test_an_interrupted_drive_is_said_loudly(tmp_path, capsys):
    stub = ("--teeth", "38", "55", "--addendum", "0.5")
    assert main(["new", "gearbox", "mine", *SHEET, *stub, "--dir", str(tmp_path)]) == 0
    assert "contact ratio 0.9" in capsys.readouterr().err
    assert (tmp_path / "gear" / "mine.yaml").exists()


def test_on_a_terminal_it_asks(tmp_path, monkeypatch):
    answers = iter(
        ["20", "20, 45", "3", "1500", "60", "", "30 28", "", ""]
    )  # the first is one number too few
    monkeypatch.setattr("builtins.input", lambda question: next(answers))
    monkeypatch.setattr(
        sys, "stdin", type("Terminal", (), {"isatty": lambda self: True})()
    )
    assert main(["new", "gearbox", "mine", "--dir", str(tmp_path)]) == 0
    gear = yaml.safe_load((tmp_path / "gear" / "mine.yaml").read_text())
    assert [gear[side]["face_width_mm"] for side in ("pinion", "wheel")] == [30.0, 28.0]
    assert gear["rated_torque_nm"] == 60.0


@pytest.mark.parametrize(
    "name", ["", "1a", "a/b", "a b", "None", "true", "é", "a" * 65, "-a", "a.b"]
)
def test_unsafe_names(name):
    assert not is_option_name(name)
    assert is_option_name("FZG-C_1")
