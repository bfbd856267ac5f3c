"""README.md: its ten lines of shell and of Python run, its links lead somewhere."""

import re

import pytest
from docs_pages import ROOT, command_lines

import diagnose.cli
import gensig.cli
from diagnose.commands.predict import OUT_OF_DISTRIBUTION
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}
SMALLER = {"plan.n_records=80": ["plan.n_records=24", "executor.n_workers=1"]}
WRITTEN = (
    "crack.png",
    "missing.png",
    "missing.csv",
    "quick.npz",
    "runs/net/report.html",
)


def block(title):
    """The code of the section with this title, fences included."""
    pattern = rf"^## {title}\n.*?(^```\w+\n.*?^```)"
    (code,) = re.findall(pattern, TEXT, flags=re.DOTALL | re.MULTILINE)
    return code


def test_ten_lines_of_shell(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lines = list(command_lines(block("Ten lines of shell")))
    assert len(lines) == 10
    for _, (command, *words) in lines:
        typed = [word for given in words for word in SMALLER.get(given, [given])]
        status = MAIN[command](typed)
        # so few machines may not have run at the speed of the recording
        assert status == 0 or (words[0], status) == ("predict", OUT_OF_DISTRIBUTION), (
            words
        )
    assert "is whole and unaltered" in capsys.readouterr().out
    for name in WRITTEN:
        assert (tmp_path / name).stat().st_size > 1000, name


def test_ten_lines_of_python(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code = block("Ten lines of Python").split("\n", 1)[1].removesuffix("```")
    lines = [line for line in code.splitlines() if line and "import" not in line]
    assert len(lines) == 10
    names = {}
    exec(code, names)
    classes = "['healthy', 'crack', 'pitting', 'missing_tooth']"
    assert capsys.readouterr().out.startswith(classes)
    assert names["signals"].shape == (2, 4, 51200)
    assert names["windows"].shape == (64, 4, 4096)
    assert names["severity"].shape == (64,)


def test_it_is_short_and_narrow():
    lines = TEXT.splitlines()
    assert len(lines) <= 115
    assert max(map(len, lines)) <= 100
    code = re.findall(r"^```\w+\n(.*?)^```", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert len(code) == 4
    assert max(len(line) for text in code for line in text.splitlines()) <= 80


def test_the_two_commands_are_those_of_the_makefile():
    targets = re.findall(r"^make (\w+)", block("Two commands"), flags=re.MULTILINE)
    assert targets == ["demo", "test"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert all(f"\n{target}:" in makefile for target in targets)


def test_its_numbers_of_the_demo_are_those_of_its_plan():
    told = re.findall(r"^make demo +# (\d+) records of (\d+) machines", TEXT, re.M)
    plan = make_plan(read_request(["experiment=quickstart"]).config)
    n_units = len(set(plan.columns["unit_id"]))
    assert told == [(str(plan.n_records), str(n_units))]


def test_its_installation_brings_what_its_commands_need():
    """`diagnose`, and the package of the formats that the line on exports names."""
    (formats,) = re.findall(r"gensig export .*# or (.*)", TEXT)
    assert {"hf", "parquet"} <= set(re.findall(r"\w+", formats))
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    recipe = makefile.partition("/.installed:")[2].partition("\n\n")[0]
    (of_demo,) = re.findall(r"\.\[(.*)\]", recipe)
    (of_readme,) = re.findall(r"Without `make`: `pip install '\.\[(.*)\]'`", TEXT)
    assert of_demo == of_readme == "diagnose,parquet"


@pytest.mark.parametrize(
    "page", ["README.md", "docs/index.md", "docs/alternatives.md", "docs/tour.ipynb"]
)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    near = [link for link in links if not link.startswith(("http", "attachment"))]
    assert near
    folder = (ROOT / page).parent
    assert [link for link in near if not (folder / link.split("#")[0]).exists()] == []
