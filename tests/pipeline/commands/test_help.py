"""Help, examples, exit statuses, tab key, and one clear line with the nearest names for typical mistakes."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import command_page
import pytest

import diagnose.cli
import gensig.cli
from gensig.commands.verbs import VERBS
from gensig.options import files as option_files
from gensig.options.compose import compose

MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}
EXAMPLES = [
    (name, example)
    for name, parser in command_page.parsers().items()
    for example in command_page.examples(parser.epilog)
]
CHEAP = (
    "gensig options", "gensig options fault", "gensig options fault=crack --json", "gensig completion bash",
    "gensig completion fish", "gensig plan experiment=quickstart plan.n_records=2000",
    "gensig modes system=engine_gear_train --json modes.json --plot modes.png",
    "gensig root-stress gear=engine_pump_drive --stress 349.39 --json root.json --plot root.png",
    "gensig stiffness fault=crack fault.crack_depth_mm=1.5 --json crack.json --plot crack.png",
)  # fmt: skip


def words_of(example: str) -> list[str]:
    return re.sub(r'^eval "\$\((.*)\)"$', r"\1", example).split()


@pytest.mark.parametrize("name", command_page.parsers())
def test_help_has_an_example_and_the_exit_statuses(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command, verb = name.split()
    assert MAIN[command]([verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert (
        f"  {name}" in text.partition("example")[2]
        or f"{name} " in text.partition("example")[2]
    )
    for status in (0, 2, 130):
        assert re.search(rf"^  {status} +\S", text, re.MULTILINE)


@pytest.mark.parametrize(
    ("name", "example"), EXAMPLES, ids=[example for _, example in EXAMPLES]
)
def test_every_example_parses_and_composes(name: str, example: str) -> None:
    words = words_of(example)
    assert " ".join(words[:2]) in command_page.parsers()
    arguments = command_page.parsers()[" ".join(words[:2])].parse_intermixed_args(
        words[2:]
    )
    overrides = getattr(arguments, "overrides", None)
    if (
        words[1] in ("evaluate", "resume", "twin")
        or not overrides
        or getattr(arguments, "config_dir", None)
    ):
        return
    if not any(
        "," in word and "[" not in word for word in overrides
    ):  # a sweep is several configurations
        compose("train" if words[1] == "train" else "generate", overrides)


@pytest.mark.parametrize("example", CHEAP)
def test_a_cheap_example_runs_as_printed(
    example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert example in [one for _, one in EXAMPLES]
    monkeypatch.chdir(tmp_path)
    words = example.split()
    assert MAIN[words[0]](words[1:]) == 0
    for flag in ("--json", "--plot"):
        if flag in words and words[-1] != flag:
            assert (tmp_path / words[words.index(flag) + 1]).stat().st_size > 100


def test_the_page_of_commands_is_that_of_the_verbs() -> None:
    assert command_page.PAGE.read_text(encoding="utf-8") == command_page.page(), (
        "run python tests/command_page.py"
    )


def test_each_command_knows_the_verbs_of_the_other() -> None:
    assert set(gensig.cli.OF_DIAGNOSE) == set(diagnose.cli.VERBS) - set(VERBS)
    assert set(diagnose.cli.OF_GENSIG) <= set(VERBS) - set(diagnose.cli.VERBS)


MISTAKES = {
    "gensig generat": "did you mean 'generate'?",
    "gensig train data=x": "a command of diagnose",
    "gensig fault=crack": "stands behind a command",
    "gensig generate fault=crakc out=x": "did you mean 'crack'?",
    "gensig generate falt=crack out=x": "did you mean 'fault'",
    "gensig generate plan.classes=[crak] out=x": "did you mean 'crack'?",
    "gensig generate plan.classes=[worn] out=x": "did you mean 'wear'? there is broken",
    "gensig generate experiment=quikstart out=x": "did you mean 'quickstart'?",
    "gensig generate system=spurpair out=x": "did you mean 'spur_pair'?",
    "gensig generate operating.speed=1200 out=x": "'operating.speed_rpm'",
    "gensig generate fault=crack fault.crack_depth=1 out=x": "did you mean 'fault.crack_depth_mm'?",
    "gensig generate fault crack out=x": "neither group=option nor key=value",
    "gensig generate --fault=crack out=x": "no dashes: fault=crack",
    "gensig generate fault=crack,pitting out=x": "need -m",
    "gensig generate mesh.law=onesided out=x": "mesh.law = 'onesided'; allowed: paper, one_sided",
    "gensig generate sensing.channels=[pinon_x] out=x": "allowed: pinion_x",
    "gensig generate plan.vary={operating.sped_rpm:{distribution:uniform,low:1,high:2}} out=x": "'operating.speed_rpm'",
    "gensig generate out=": "out is required",
    "gensig generate executor=cuda out=x": "there is dask, local, slurm",
    "gensig verify": "missing: DIR",
    "gensig verify x --quik": "did you mean '--quick'?",
    "gensig verify x y": "'y' is one word too many",
    "gensig reproduce x --records many": "--records many is not a whole number",
    "gensig stiffness -plot x.png": "did you mean '--plot'?",
    "gensig stiffness --plot x.jpg": "must end in .png",
    "gensig stiffness --json nodir/x.json": "there is no folder nodir",
    "gensig wear-life --torques 10 20 fault=wear": "key=value words stand before --torques",
    "gensig forced-response --run 650 1750": "--run needs LOW HIGH STEP",
    "gensig modify-flank": "missing: --out FILE",
    "gensig modify-flank --out nodir/x.yaml": "there is no folder nodir",
    "gensig options falt": "did you mean 'fault'?",
    "gensig options crack": "gensig options fault=crack",
    "gensig options fault=crakc": "did you mean 'crack'?",
    "gensig completion powershell": "is not one of bash, zsh, fish",
    "diagnose trian": "did you mean 'train'?",
    "diagnose generate": "a command of gensig",
    "diagnose train data=x out=y modle=cnn": "did you mean 'model'",
    "diagnose train data=x out=y model=cnnn": "did you mean 'cnn' or 'wdcnn'?",
    "diagnose predict x.csv --modle y": "did you mean '--model'?",
    "diagnose detectability --speeds fast": "give numbers",
    "diagnose adapt --model x --healthy a.csv --method adbn --out y": "is not one of adabn, coral",
}


@pytest.mark.parametrize("typed", MISTAKES)
def test_a_typical_mistake_is_one_line_that_helps(
    typed: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    command, *words = typed.split()
    assert MAIN[command](words) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith(f"{command}: ")
    assert MISTAKES[typed] in line
    assert not list(tmp_path.iterdir())


def test_what_is_typed_and_not_read_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "modes",
        "system=two_stage_gearbox",
        "gear=harbin_38_55",
        "operating.speed_rpm=5",
        "out=x",
    ]
    assert MAIN["gensig"](words) == 0
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "gensig: note: gear is not read by modes",
        "gensig: note: operating.speed_rpm is not read by modes",
        "gensig: note: out is not read by modes; use --json or --plot",
    ]
    assert MAIN["gensig"](["modes", "gear=xiamen_23_84", "operating.torque_nm=30"]) == 0
    assert "not read" not in capsys.readouterr().err


@pytest.mark.parametrize("group", [group.name for group in option_files.groups()])
def test_every_group_and_option_has_a_line_and_the_keys_that_hydra_reads(
    group: str,
) -> None:
    (one,) = [found for found in option_files.groups() if found.name == group]
    assert one.about
    for option in option_files.options(group):
        assert option.about
        keys = option_files.option_keys(group, option.name)
        assert keys
        must_be_given = [f"{key.name}=given" for key in keys if key.text == "???"]
        listed = {key.name for key in keys}
        if one.primary == "generate" and group not in (
            "experiment",
            "system",
            "excitation",
        ):
            composed = compose("generate", [f"{group}={option.name}", *must_be_given])[
                group
            ]
            assert {name.split(".")[1] for name in listed} == set(composed)


def test_options_of_a_users_folder_are_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gear").mkdir()
    (tmp_path / "gear" / "mine.yaml").write_text(
        "# Our pair. More.\nname: mine   # ours\nbacklash_um: 40\n"
    )
    assert (
        MAIN["gensig"](["options", "gear", "--config-dir", str(tmp_path), "--json"])
        == 0
    )
    assert {"name": "mine", "about": "Our pair"} in json.loads(capsys.readouterr().out)[
        "options"
    ]
    assert (
        MAIN["gensig"](
            ["options", "gear=mine", "--config-dir", str(tmp_path), "--json"]
        )
        == 0
    )
    name, backlash = json.loads(capsys.readouterr().out)["keys"]
    assert name == {
        "name": "gear.name",
        "text": "mine",
        "value": "mine",
        "unit": "",
        "comment": "ours",
    }
    assert backlash == {
        "name": "gear.backlash_um",
        "text": "40",
        "value": 40,
        "unit": "um",
        "comment": "",
    }


def completed(line: str, tmp_path: Path) -> set[str]:
    """What the tab key is offered at the end of a line."""
    answer = tmp_path / "answer"
    asked = {
        "_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line, "COMP_POINT": str(len(line)),
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
    }  # fmt: skip
    command = [sys.executable, "-c", f"from {line.split()[0]}.cli import main; main()"]
    subprocess.run(
        command, env={**os.environ, **asked}, check=True, capture_output=True
    )
    return {word.strip() for word in answer.read_text(encoding="utf-8").split("\n")}


@pytest.mark.parametrize(
    ("line", "offered", "absent"),
    [
        ("gensig gen", {"generate"}, {"plan"}),
        ("gensig generate --qu", {"--quiet"}, {"--json"}),
        ("gensig generate fau", {"fault=", "fault.kind="}, {"gear="}),
        ("gensig generate fault=c", {"fault=crack", "fault=chipped"}, {"fault=wear"}),
        (
            "gensig generate fault=crack fault.crack_d",
            {"fault.crack_depth_mm="},
            {"fault.crack_angle_deg="},
        ),
        ("gensig options fault=cr", {"fault=crack"}, {"fault=wear"}),
        ("diagnose train mod", {"model=", "model.kind="}, {"gear="}),
        ("diagnose detectability fault=c", {"fault=crack"}, {"model="}),
    ],
)
def test_the_tab_key_knows_verbs_flags_options_and_keys(
    line: str, offered: set[str], absent: set[str], tmp_path: Path
) -> None:
    found = completed(line, tmp_path)
    assert offered <= found
    assert not absent & found


def test_the_tab_key_completes_paths_of_keys(tmp_path: Path) -> None:
    """Zsh and fish take `data=...` for one word and would offer no files by themselves."""
    (tmp_path / "here").mkdir()
    (tmp_path / "her.csv").touch()
    for line in (
        "diagnose train data=",
        "gensig generate out=",
        "gensig modes system.gears_csv=",
    ):
        key = line.split()[-1]
        assert completed(f"{line}{tmp_path}/he", tmp_path) == {
            f"{key}{tmp_path}/here/",
            f"{key}{tmp_path}/her.csv",
        }


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_what_a_shell_sources_names_both_commands(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert MAIN["gensig"](["completion", shell]) == 0
    text = capsys.readouterr().out
    assert all(command in text for command in MAIN)
    if shell == "bash":
        done = subprocess.run(
            ["bash", "-c", f"{text}\ncomplete -p gensig diagnose"],
            capture_output=True,
            check=True,
        )
        assert done.stdout.count(b"\n") == 2


def test_help_loads_nothing_that_is_slow() -> None:
    slow = ("numpy", "yaml", "hydra", "argcomplete", "torch")
    for command in MAIN:
        code = f"import sys; from {command}.cli import main; main(['--help']); "
        code += f"sys.exit(any(name in sys.modules for name in {slow}))"
        assert (
            subprocess.run(
                [sys.executable, "-c", code], capture_output=True, check=False
            ).returncode
            == 0
        )
