"""gensig new gearbox of several stages: tables that close, options that run as printed."""

import csv
import itertools
import json
import re
import shlex
import sys
from argparse import Namespace

import pytest
import yaml
from numpy.testing import assert_allclose

from gensig import open_dataset
from gensig.cli import main
from gensig.commands.new.data_sheet import DataSheet, gear_option
from gensig.commands.new.gearbox import _shaft
from gensig.commands.new.line_tables import shafting_table, torsional_stiffness
from gensig.commands.new.stages import read_gearbox, shaft_diameters
from gensig.driveline.reading import read_line_machine
from gensig.errors import GensigError
from gensig.plan.request import read_request
from gensig.systems.derived_sizes import bores

SHEET = "--teeth 29 100 36 90 --module 1.5 2 --speed 1500 --torque 10"
NEW = f"new gearbox mine {SHEET} --dir . --no-level"


LEFT_OUT = (
    "widths",
    "bores",
    "supports",
    "sensors",
    "profile_shifts",
    "helix",
    "pressure_angle",
    "addendum",
)


def gearbox(**changes):
    """The gearbox of the flags of `SHEET`."""
    given = {
        "name": "a",
        "experiment": "plain",
        "teeth": [29, 100, 36, 90],
        "module": [1.5, 2.0],
        "speed": 1500.0,
        "torque": 10.0,
    }
    return read_gearbox(Namespace(**{**dict.fromkeys(LEFT_OUT), **given, **changes}))


def test_one_stage_has_the_shafts_of_the_single_pair():
    assert shaft_diameters([(29, 100)], [1.5]) == list(bores((29, 100), 1.5))


def test_a_pair_is_a_gearbox_of_one_stage():
    (stage,) = gearbox(teeth=[29, 100], module=[1.5]).stages
    pair = DataSheet(name="a", teeth=(29, 100), module=1.5, speed=1500.0, torque=10.0)
    assert stage.gear == gear_option(pair).gear


def test_the_stress_of_a_shaft_is_that_of_a_round_bar():
    stress = _shaft(1500.0, 60.0, 20.0)["torsional_stress_mpa"]
    assert stress == pytest.approx(38.2, rel=1e-3)


def test_edges_lead_from_the_motor_to_the_load():
    lines = shafting_table(gearbox()).splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    edges = [(row["edge_from"], row["edge_to"]) for row in rows if row["edge_from"]]
    assert edges == [(str(node), str(node + 1)) for node in range(1, len(edges) + 1)]
    assert len(edges) == 7


def test_a_stage_is_the_pair_of_its_own_speed_torque_and_bores():
    made = gearbox()
    slowdown = made.slowdowns[1]
    assert slowdown == pytest.approx(100 / 29, rel=1e-15)
    second = DataSheet(
        name="a",
        teeth=(36, 90),
        module=2.0,
        speed=1500.0 / slowdown,
        torque=10.0 * slowdown,
        bores=tuple(made.diameters[1:]),
    )
    assert made.stages[1].gear == gear_option(second).gear
    power = [stage.derived()["power_kw"] for stage in made.stages]
    assert_allclose(*power, rtol=1e-12)


def test_a_shaft_between_two_stages_suits_both():
    first, between, last = shaft_diameters([(29, 100), (20, 70)], [1.5, 1.5])
    assert between == bores((20, 70), 1.5)[0] < bores((29, 100), 1.5)[1]
    assert (first, last) == (bores((29, 100), 1.5)[0], bores((20, 70), 1.5)[1])


def test_a_shaft_of_steel_is_as_stiff_as_the_textbook_says():
    """25 mm thick and 100 mm long at G = 79.6 GPa: 3.05e4, as in two_stage_shafting.csv."""
    stiffness = torsional_stiffness(79.6e9, 25.0, 100.0)
    assert stiffness == pytest.approx(3.05e4, rel=2e-3)


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (SHEET, ["Input pinion", "Idler gear 1", "Idler gear 2", "Output gear"]),
        (
            f"{SHEET} --teeth 29 100 36 90 24 60 --module 2 --helix 15 --widths 18",
            ["Input pinion", *[f"Idler gear {k}" for k in range(1, 5)], "Output gear"],
        ),
    ],
)
def test_the_tables_close_and_carry_the_given_torque(words, names, gensig, tmp_path):
    said, _ = gensig(f"new gearbox mine {words} --dir . --json --no-level")
    told = json.loads(said)
    config = read_request(["experiment=mine"], config_dir=tmp_path).config
    machine = read_line_machine(config)
    drive = machine.engine.drive

    assert [gear.name for gear in drive.line.gears] == names
    assert_allclose(
        abs(drive.line.speed_ratio[-1]), 1.0 / told["derived"]["ratio"], rtol=1e-12
    )
    assert_allclose(machine.mesh_forces, told["stages"]["mesh_force_n"], rtol=1e-6)
    # each gear is on a support for the force of its own teeth
    held = drive.support_forces
    for mesh, force in zip(drive.line.meshes, machine.mesh_forces, strict=True):
        ends = held[mesh.driving], held[mesh.driven]
        assert_allclose(ends, force, rtol=1e-6)
    assert machine.operating.torque == 10.0
    for side, key in (("driving", "pinion"), ("driven", "wheel")):
        gears = [
            drive.line.gears[getattr(mesh, side)].mass for mesh in drive.line.meshes
        ]
        assert_allclose(gears, told["stages"][f"{key}_mass_kg"], rtol=1e-9)
    backlash = [1e6 * mesh.backlash for mesh in drive.line.meshes]
    assert_allclose(backlash, told["stages"]["backlash_um"], rtol=1e-9)


def test_every_value_says_where_it_is_from(gensig, tmp_path):
    gensig(f"{NEW} --profile-shifts 0.1 --grade 7 --rate 25600")
    for group in ("system", "experiment"):
        text = (tmp_path / group / "mine.yaml").read_text()
        values = re.findall(r"^ +[^#\s-][^:]*: \S.*$", text, re.MULTILINE)
        bare = [line.split(":")[0].strip() for line in values if "#" not in line]
        of_bearing = ["n_balls", "ball_diameter_mm", "pitch_diameter_mm"]
        of_bearing += ["inner_groove_conformity", "outer_groove_conformity"]
        of_tables = ["name", "shafting_csv", "gears_csv", "radial_clearance_um"]
        assert set(bare) <= {*of_bearing, *of_tables}
    for table in ("gears", "shafting"):
        head = (tmp_path / "tables" / f"mine_{table}.csv").read_text()
        assert all(word in head for word in ("Given: ", "Assumed: ", "Derived: "))
        assert max(map(len, head.split("node,")[0].splitlines())) <= 100
    experiment = yaml.safe_load((tmp_path / "experiment" / "mine.yaml").read_text())
    assert experiment["quality"]["iso1328_grade"] == 7
    assert experiment["sensing"]["sampling_rate_hz"] == 25600


def test_the_printed_commands_work_as_printed_with_a_note_on_the_folder_alone(
    gensig, tmp_path
):
    said, _ = gensig(f"new gearbox mine {SHEET}")
    lines = said.partition("next:\n")[2].splitlines()
    simulate, generate, report = (shlex.join(shlex.split(line)[1:]) for line in lines)
    cheap = "operating.duration_s=0.1"
    said, warned = gensig(f"{simulate} {cheap} operating.torque_nm=12")
    (note,) = [line for line in warned.splitlines() if "note" in line]
    assert "./configs is read for options of your own" in note
    assert float(re.search(r"mesh frequency (\S+)", said)[1]) == pytest.approx(
        725.0, rel=1e-3
    )
    few = "plan.n_records=4 plan.n_units=2 plan.classes=[healthy,missing_tooth]"
    _, warned = gensig(f"{generate} {cheap} {few} executor.n_workers=1")
    assert "mean tooth forces" not in warned
    gensig(report)
    gensig("verify runs/mine")
    second = f"{simulate.split(' --plot')[0]} {cheap} system.record_mesh=[5,6]"
    said, _ = gensig(f"{second} fault.gear=wheel")
    assert float(re.search(r"mesh frequency (\S+)", said)[1]) == pytest.approx(
        261.0, rel=1e-3
    )


@pytest.mark.parametrize(
    "words",
    [SHEET, "--teeth 24 60 24 60 24 60 --module 1.5 2 3 --speed 3000 --torque 20"],
    ids=["two stages", "three stages"],
)
def test_records_are_of_all_gears_and_of_the_two_evaluation_method(
    words, gensig, tmp_path
):
    """Every gear has a channel, faults are on any gear, and steps are checked."""
    gensig(f"new gearbox mine {words} --dir . --json --no-level")
    few = (
        "plan.n_records=6 plan.n_units=3 operating.duration_s=0.1 executor.n_workers=1"
    )
    classes = "plan.classes=[healthy,missing_tooth]"
    gensig(f"generate --config-dir . experiment=mine {few} {classes} out=runs/mine")
    with open_dataset(tmp_path / "runs" / "mine") as data:
        gears = data.attributes["gear_names"]
        assert data.channel_names == [f"{gear}_y" for gear in gears]
        assert (data.sampling_rate, set(data.column("status"))) == (51200.0, {"ok"})
        assert set(data.column("integration_check")) == {"error"}
        assert data.column("integration_error").max() < 1e-3
        assert set(data.column("fault_gear")) <= {"", *gears}


@pytest.mark.parametrize(
    ("rate", "steps"), [("", 5), ("--rate 102400", 5), ("--rate 12800", 20)]
)
def test_steps_are_as_short_at_any_rate(rate, steps, gensig, tmp_path):
    gensig(f"{NEW} {rate}")
    config = read_request(["experiment=mine"], config_dir=tmp_path).config
    assert config["solver"]["oversampling"] == steps
    step = 1.0 / (steps * config["sensing"]["sampling_rate_hz"])
    assert step <= 1.0 / 256000.0


@pytest.mark.parametrize(("words", "steps"), [("", 8), ("--rate 25600", 16)])
def test_helical_stages_have_shorter_steps(gensig, tmp_path, words, steps):
    gensig(f"{NEW} --helix 15 {words}")
    experiment = yaml.safe_load((tmp_path / "experiment" / "mine.yaml").read_text())
    assert experiment["solver"] == {"backend": "nystroem", "oversampling": steps}
    assert experiment["plan"]["fault_gear"] == "drawn"


def test_shipped_and_taken_names_are_refused(gensig, tmp_path, capsys):
    assert main(NEW.replace("mine", "two_stage_gearbox").split()) == 2
    assert "system=two_stage_gearbox comes with gensig" in capsys.readouterr().err
    gensig(NEW)
    (tmp_path / "experiment" / "mine.yaml").unlink()
    assert main(NEW.split()) == 0  # as after a killed call: the same texts are finished
    (tmp_path / "experiment" / "mine.yaml").unlink()
    (tmp_path / "system" / "mine.yaml").write_text("# of somebody else\n")
    assert main(NEW.split()) == 2
    assert "mine.yaml is there already" in capsys.readouterr().err


def test_stages_are_doubted_one_by_one(gensig):
    _, warned = gensig(f"{NEW} --torque 100 --module 1.5")
    assert "stage 2: a nominal root stress of" in warned
    assert "stage 1" not in warned


def test_on_a_terminal_it_asks_for_stages(gensig, tmp_path, monkeypatch):
    answers = itertools.chain(
        ["29 100 36", "29 100 36 90", "1.5, 2", "1500", "10"], [""]
    )
    monkeypatch.setattr("builtins.input", lambda question: next(answers))
    terminal = type("Terminal", (), {"isatty": lambda self: True})
    monkeypatch.setattr(sys, "stdin", terminal())
    gensig("new gearbox mine --dir . --no-level")
    assert (tmp_path / "tables" / "mine_gears.csv").exists()
    assert list(answers) == []


def test_an_error_of_a_stage_keeps_its_kind():
    with pytest.raises(GensigError, match="stage 1, 29/100: --module 99 must lie in"):
        gearbox(module=[99.0, 2.0])
