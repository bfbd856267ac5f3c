"""gensig new gearbox: derived values, written options, printed commands."""

import itertools
import json
import math
import re
import shlex
import sys

import numpy as np
import pytest
import yaml
from docs_pages import ROOT, blocks, command_lines
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.commands.new.data_sheet import DataSheet, gear_option, least_backlash
from gensig.plan.request import read_request
from gensig.production.streaming import open_stream
from gensig.systems.root_strength import read_root_strength
from gensig.text.option_writing import is_option_name

SIDES = ("pinion", "wheel")
SHEET = "--teeth 20 45 --module 3 --speed 1500 --torque 60"
NEW = f"new gearbox mine {SHEET} --dir . --no-level"


def option(**changes):
    values = {"teeth": (20, 45), "module": 3.0, "speed": 1500.0, "torque": 60.0}
    return gear_option(DataSheet(**{"name": "a", **values, **changes}))


def test_masses_are_those_of_steel_discs_with_bores():
    machine = option(widths=(30.0, 28.0), bores=(24.0, 40.0)).machine
    for body, radius, bore, width in (
        (machine.pinion, 0.030, 0.012, 0.030),
        (machine.wheel, 0.0675, 0.020, 0.028),
    ):
        area = math.pi * (radius**2 - bore**2)
        mass = machine.material.density_kg_per_m3 * area * width
        inertia = 0.5 * mass * (radius**2 + bore**2)
        assert_allclose([body.mass, body.inertia], [mass, inertia], rtol=1e-12)


def test_a_gearbox_twice_as_large_scales_as_it_should():
    one, two = option(), option(module=6.0, torque=480.0)
    assert_allclose(two.pair.center_distance, 2 * one.pair.center_distance, rtol=1e-12)
    assert_allclose(two.machine.pinion.mass, 8 * one.machine.pinion.mass, rtol=1e-9)
    ratios = [each.pair.transverse_contact_ratio for each in (one, two)]
    assert_allclose(*ratios, rtol=1e-12)
    supports = [each.machine.pinion.support.stiffness_y for each in (one, two)]
    assert supports[1] > supports[0]


def test_backlash_is_that_of_the_printed_rule():
    expected = 2e3 / 3 * (0.06 + 0.05 + 0.15)
    assert least_backlash(100.0, 5.0) == pytest.approx(expected, abs=0.05)


def test_derived_values_are_those_of_the_textbook():
    derived = option(widths=(30.0, 28.0)).derived()
    expected = {
        "wheel_speed_rpm": 1500.0 * 20 / 45,
        "wheel_torque_nm": 60.0 * 45 / 20,
        "power_kw": 60.0 * 1500.0 * math.pi / 30e3,
        "pitch_line_speed_m_per_s": 1500.0 / 60.0 * math.pi * 0.060,
        "tooth_force_per_width_n_per_mm": 2000.0 / 28.0,
        "mesh_frequency_hz": 500.0,
    }
    result = [derived[key] for key in expected]
    assert_allclose(result, list(expected.values()), rtol=1e-12)


def test_every_value_of_the_option_has_a_remark_and_the_given_ones_are_kept(
    gensig, tmp_path
):
    more = "--widths 25 --bores 22 40 --supports 1e8 --profile-shifts 0.2 -0.1 --json"
    said, _ = gensig(f"{NEW} {more}")
    text = (tmp_path / "gear" / "mine.yaml").read_text()
    gear = yaml.safe_load(text)
    given = {
        "face_width_mm": [25.0, 25.0],
        "bore_radius_mm": [11.0, 20.0],
        "profile_shift": [0.2, -0.1],
    }
    for key, values in given.items():
        assert [gear[side][key] for side in SIDES] == values
    assert gear["wheel"]["support"]["stiffness_x_n_per_m"] == 1e8
    values = [line for line in text.splitlines() if ": " in line and "name" not in line]
    assert [line for line in values if "#" not in line] == []
    derived = json.loads(said)["derived"]
    assert 1.2 < derived["transverse_contact_ratio"] < 2.0
    system = read_root_strength(read_request(["gear=mine"], config_dir=tmp_path).config)
    nominal = system.gears()[system.decisive].nominal * 1e-6
    assert_allclose(derived["nominal_root_stress_mpa"], nominal, rtol=1e-9)


DOUBTS = {
    "--torque 55000": "root stress of .* MPa: no steel bears more than about 1000; are --torque",
    "--torque 0.055": "gears that do no work",
    "--speed 24.5": "is it r/min, not Hz",
    "--speed 90000": "pitch line speed of 283 m/s, outside 0.05 to 60",
    "--widths 0.025": "the wheel is 0.00833 modules wide",
    "--teeth 38 55 --addendum 0.5": "contact ratio 0.9",
}


@pytest.mark.parametrize("words", DOUBTS)
def test_values_of_another_unit_are_doubted(words, gensig, tmp_path):
    assert re.search(DOUBTS[words], gensig(f"{NEW} {words}")[1])
    assert (tmp_path / "gear" / "mine.yaml").exists()


def test_nothing_is_overwritten_and_sound_values_are_not_doubted(
    gensig, tmp_path, capsys
):
    assert gensig(f"{NEW} --torque 90")[1] == ""
    before = (tmp_path / "gear" / "mine.yaml").read_bytes()
    assert main(NEW.split()) == 2
    assert "is there already" in capsys.readouterr().err
    assert (tmp_path / "gear" / "mine.yaml").read_bytes() == before


def test_the_howto_shows_what_the_commands_print(gensig, tmp_path):
    page = (ROOT / "docs/howto/your_gearbox.md").read_text(encoding="utf-8")
    code = [block.code for block in blocks(page)]
    measured = next(k for k, text in enumerate(code) if "realistic" in text)

    def printed(text):
        ((_, words),) = command_lines(f"```sh\n{text}\n```")
        return gensig("", *words[1:])

    made, shown, planned, facts = code[measured : measured + 4]
    assert printed(made)[0].strip() == shown.strip()
    text = (tmp_path / "configs/experiment/reducer.yaml").read_text()
    values = re.findall(r"^ *[^#\s-].*: \S.*$", text, re.MULTILINE)
    origin = re.compile(r"# (given|derived|assumed|about|whole)")
    assert values
    assert [line for line in values if not origin.search(line)] == []
    config = read_request(["experiment=reducer"], config_dir="configs").config
    sensing, plan = config["sensing"], config["plan"]
    assert (sensing["sampling_rate_hz"], sensing["sensors"]) == (25600, ["housing"])
    assert sensing["path"]["natural_frequency_hz"] == [300, 10000]
    classes = ["healthy", "crack", "pitting", "missing_tooth", "wear"]
    assert plan["classes"] == classes
    torque = {"distribution": "uniform", "low": 27.5, "high": 55}
    assert plan["vary"]["operating.torque_nm"] == torque
    said = "".join(printed(planned))
    assert [line for line in facts.strip().splitlines() if line not in said] == []


REALISTIC = "--experiment realistic --rate 16000 --classes healthy wear"
HELICAL = "--helix 20"


@pytest.mark.parametrize("more", ["", f"{HELICAL} {REALISTIC}"])
def test_the_printed_commands_work_as_printed(more, gensig, tmp_path):
    said, _ = gensig(f"new gearbox mine {SHEET} {more}")
    lines = said.partition("next:\n")[2].splitlines()
    simulate, generate, report = (shlex.join(shlex.split(line)[1:]) for line in lines)
    cheap = "operating.duration_s=0.1 mesh.n_slices=4"
    said, _ = gensig(f"{simulate} {cheap}")
    mesh = float(re.search(r"mesh frequency (\S+)", said)[1])
    tolerance = {True: 2e-2, False: 1e-3}["realistic" in more]  # a speed that wanders
    assert mesh == pytest.approx(500.0, rel=tolerance)
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")
    few = "plan.n_records=4 plan.n_units=2 plan.classes=[healthy,wear]"
    gensig(f"{generate} {cheap} {few} executor.n_workers=1")
    gensig(report)
    gensig("verify runs/mine")


def test_tips_are_relieved_for_the_rated_torque(gensig, tmp_path):
    gensig(NEW)
    written = yaml.safe_load((tmp_path / "modification" / "mine.yaml").read_text())
    machine = option().machine
    relief = machine.long_relief()
    for side in SIDES:
        cut = relief.sides[side]
        assert written[side]["tip_relief_um"] == round(1e6 * cut.tip_relief, 2)
        height = 1e3 * cut.tip_relief_height
        assert written[side]["tip_relief_height_mm"] == round(height, 3)
    config = read_request(["experiment=mine"], config_dir=tmp_path).config
    used = config["modification"]["pinion"]["tip_relief_um"]
    assert used == written["pinion"]["tip_relief_um"] > 2.0


def test_helical_teeth_get_no_relief(gensig, tmp_path):
    gensig(f"{NEW} --helix 20")
    assert not (tmp_path / "modification").exists()
    config = read_request(["experiment=mine"], config_dir=tmp_path).config
    assert config["modification"]["pinion"]["tip_relief_um"] == 0


def test_the_level_is_that_of_the_records_that_follow(gensig, tmp_path):
    said, _ = gensig(f"new gearbox mine {SHEET} --dir . --json")
    level = json.loads(said)["healthy_level"]
    assert (level["at"], level["machines"]) == ("bearings", 8)
    assert level["iso_20816_3_zone"] is None
    stream = open_stream(
        read_request(
            [
                "experiment=mine",
                "plan.classes=[healthy]",
                "plan.n_records=8",
                "plan.n_units=8",
                "plan.n_gearboxes=8",
                "operating.speed_rpm=1500",
                "operating.torque_nm=60",
                "operating.duration_s=0.5",
                "sensing.snr_db=null",
            ],
            config_dir=tmp_path,
        ).config
    )
    rms = [record.signals["acceleration"].std(axis=1) for record in stream]
    expected = np.median(rms, axis=0) / 9.80665
    assert_allclose(list(level["rms_g"].values()), expected, rtol=1e-4)


def test_a_machine_without_records_has_no_level(gensig, tmp_path):
    low = "--teeth 38 55 --addendum 0.5"
    _, told = gensig(f"new gearbox mine {SHEET} {low} --dir .")
    assert "no healthy level: the transverse contact ratio" in told
    assert (tmp_path / "gear" / "mine.yaml").exists()


def test_the_end_of_the_input_ends_the_questions(tmp_path, monkeypatch, capsys):
    def ended(_question):
        raise EOFError

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("builtins.input", ended)
    terminal = type("Terminal", (), {"isatty": lambda self: True})
    monkeypatch.setattr(sys, "stdin", terminal())
    assert main(["new", "gearbox", "mine", "--teeth", "20", "45"]) == 2
    message = (
        "the input ended before an answer to 'normal module, mm'; nothing is written"
    )
    assert capsys.readouterr().err == f"gensig: {message}\n"
    assert not list(tmp_path.iterdir())


def test_on_a_terminal_it_asks(gensig, tmp_path, monkeypatch):
    answers = itertools.chain(
        ["20", "20, 45", "3", "1500", "60"],  # the first is one number too few
        ["", "30 28", "", ""],
    )
    monkeypatch.setattr("builtins.input", lambda question: next(answers))
    terminal = type("Terminal", (), {"isatty": lambda self: True})
    monkeypatch.setattr(sys, "stdin", terminal())
    gensig("new gearbox mine --dir . --no-level")
    gear = yaml.safe_load((tmp_path / "gear" / "mine.yaml").read_text())
    assert [gear[side]["face_width_mm"] for side in SIDES] == [30.0, 28.0]
    assert gear["rated_torque_nm"] == 60.0


@pytest.mark.parametrize(
    "name", ["", "1a", "a/b", "a b", "None", "true", "é", "a" * 65, "-a", "a.b"]
)
def test_unsafe_names(name):
    assert not is_option_name(name)
    assert is_option_name("FZG-C_1")
