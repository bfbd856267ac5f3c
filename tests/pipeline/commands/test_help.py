"""Help, examples, exit statuses, notes on unread keys, and the tab key of both commands."""

import itertools
import json
import os
import re
import subprocess
import sys

import command_page
import pytest

import diagnose.cli
import gensig.cli
from gensig.commands.verbs import KNOWN, VERBS
from gensig.options import files as option_files
from gensig.options.compose import compose

MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}
PARSERS = command_page.parsers()
EXAMPLES = {
    example: name
    for name, parser in PARSERS.items()
    for example in command_page.examples(parser.epilog)
}
CHEAP = (
    "gensig options",
    "gensig options fault",
    "gensig options fault=crack --json",
    "gensig completion bash",
    "gensig completion fish",
    "gensig modes system=engine_gear_train --json modes.json --plot modes.png",
    "gensig root-stress gear=engine_pump_drive --stress 349.39 --json root.json --plot root.png",
)
NOT_COMPOSED = ("evaluate", "resume", "twin")


@pytest.mark.parametrize("name", PARSERS)
def test_help_has_an_example_and_the_exit_statuses(name, capsys):
    command, verb = name.split()
    assert MAIN[command]([verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert re.search(rf"\b{name}\b", text.partition("example")[2])
    for status in (0, 2, 130):
        assert re.search(rf"^  {status} +\S", text, re.MULTILINE)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_parses_and_composes(example):
    typed = re.sub(r'^eval "\$\((.*)\)"$', r"\1", example)
    command, verb, *words = typed.split()
    arguments = PARSERS[f"{command} {verb}"].parse_intermixed_args(words)
    overrides = getattr(arguments, "overrides", None)
    own_options = getattr(arguments, "config_dir", None)
    if verb in NOT_COMPOSED or not overrides or own_options:
        return
    is_sweep = any("," in word and "[" not in word for word in overrides)
    if not is_sweep:
        compose({"train": "train"}.get(verb, "generate"), overrides)


@pytest.mark.parametrize("example", CHEAP)
def test_a_cheap_example_runs_as_printed(example, tmp_path, monkeypatch):
    assert example in EXAMPLES
    monkeypatch.chdir(tmp_path)
    command, *words = example.split()
    assert MAIN[command](words) == 0
    for file in re.findall(r"\S+\.(?:json|png)", example):
        assert (tmp_path / file).stat().st_size > 100


def test_the_page_of_commands_is_that_of_the_verbs():
    text = command_page.PAGE.read_text(encoding="utf-8")
    assert text == command_page.page(), "run python tests/command_page.py"


def test_each_command_knows_the_verbs_of_the_other():
    assert set(gensig.cli.OF_DIAGNOSE) == set(diagnose.cli.VERBS) - set(VERBS)
    assert set(diagnose.cli.OF_GENSIG) <= set(VERBS) - set(diagnose.cli.VERBS)


def test_a_typed_key_that_is_not_read_gets_a_note(capsys):
    line = (
        "modes system=two_stage_gearbox gear=harbin_38_55 operating.speed_rpm=5 out=x"
    )
    assert MAIN["gensig"](line.split()) == 0
    assert capsys.readouterr().err.splitlines() == [
        "gensig: note: gear is not read by modes",
        "gensig: note: operating.speed_rpm is not read by modes",
        "gensig: note: out is not read by modes; use --json or --plot",
    ]
    assert MAIN["gensig"](["modes", "gear=xiamen_23_84", "operating.torque_nm=30"]) == 0
    assert "not read" not in capsys.readouterr().err


GROUPS = {group.name: group for group in option_files.groups()}


@pytest.mark.parametrize("name", GROUPS)
def test_every_group_and_option_has_a_line_and_the_keys_that_hydra_reads(name):
    group = GROUPS[name]
    assert group.about
    has_keys_of_its_own = name not in ("experiment", "system", "excitation")
    for option in option_files.options(name):
        assert option.about
        keys = option_files.option_keys(name, option.name)
        assert keys
        if group.primary == "generate" and has_keys_of_its_own:
            given = [f"{key.name}=given" for key in keys if key.text == "???"]
            composed = compose("generate", [f"{name}={option.name}", *given])
            assert {key.name.split(".")[1] for key in keys} == set(composed[name])


def test_options_of_a_users_folder_are_listed(tmp_path, capsys):
    file = tmp_path / "gear" / "mine.yaml"
    file.parent.mkdir()
    file.write_text("# Our pair. More.\nname: mine   # ours\nbacklash_um: 40\n")

    def listed(word):
        words = ["options", word, "--config-dir", str(tmp_path), "--json"]
        assert MAIN["gensig"](words) == 0
        return json.loads(capsys.readouterr().out)

    assert {"name": "mine", "about": "Our pair"} in listed("gear")["options"]
    name, backlash = (tuple(key.values()) for key in listed("gear=mine")["keys"])
    assert name == ("gear.name", "mine", "mine", "", "ours")
    assert backlash == ("gear.backlash_um", "40", 40, "um", "")


def completed(line, tmp_path):
    """Candidates that the tab key offers at the end of a line."""
    answer = tmp_path / "answer"
    asked = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    code = f"from {line.split()[0]}.cli import main; main()"
    environment = {**os.environ, **asked}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return {word.strip() for word in answer.read_text(encoding="utf-8").split("\n")}


@pytest.mark.parametrize(
    ("line", "offered", "absent"),
    [
        ("gensig gen", "generate", "plan"),
        ("gensig generate --qu", "--quiet", "--json"),
        ("gensig generate fau", "fault= fault.kind=", "gear="),
        ("gensig generate fault=c", "fault=crack fault=chipped", "fault=wear"),
        (
            "gensig generate fault=crack fault.crack_d",
            "fault.crack_depth_mm=",
            "fault.crack_angle_deg=",
        ),
        ("gensig options fault=cr", "fault=crack", "fault=wear"),
        ("diagnose train mod", "model= model.kind=", "gear="),
        ("diagnose detectability fault=c", "fault=crack", "model="),
        # zsh and fish take `data=...` for one word and would offer no files by themselves
        ("diagnose train data=@/he", "data=@/here/ data=@/her.csv", ""),
        (
            "gensig modes system.gears_csv=@/he",
            "system.gears_csv=@/here/ system.gears_csv=@/her.csv",
            "",
        ),
    ],
)
def test_the_tab_key_knows_verbs_flags_options_keys_and_paths(
    line, offered, absent, tmp_path
):
    (tmp_path / "here").mkdir()
    (tmp_path / "her.csv").touch()
    result = completed(line.replace("@", str(tmp_path)), tmp_path)
    assert set(offered.replace("@", str(tmp_path)).split()) <= result
    assert absent not in result


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_code_for_a_shell_names_both_commands(shell, capsys):
    assert MAIN["gensig"](["completion", shell]) == 0
    text = capsys.readouterr().out
    assert all(command in text for command in MAIN)
    if shell == "bash":
        script = f"{text}\ncomplete -p gensig diagnose"
        done = subprocess.run(["bash", "-c", script], capture_output=True, check=True)
        assert done.stdout.count(b"\n") == 2


def test_help_loads_nothing_that_is_slow():
    slow = {"numpy", "yaml", "hydra", "argcomplete", "torch"}
    for command in MAIN:
        code = (
            f"import sys; from {command}.cli import main; main(['--help']); "
            f"sys.exit(bool({slow} & set(sys.modules)))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True)
        assert done.returncode == 0
        assert b"usage:" in done.stdout


def test_every_verb_stands_once_in_the_help_in_one_of_three_groups(capsys):
    assert MAIN["gensig"](["--help"]) == 0
    blocks = capsys.readouterr().out.split("\n\n")
    shown = {}
    for block in blocks:
        head, *lines = block.splitlines()
        if head in ("data sets:", "gears:", "machines:"):
            shown[head] = [line.split()[0] for line in lines]
    assert len(shown) == 3
    assert sorted(itertools.chain(*shown.values())) == sorted(KNOWN)
    assert "generate" in shown["data sets:"]
    assert "stiffness" in shown["gears:"]
    assert "simulate" in shown["machines:"]
