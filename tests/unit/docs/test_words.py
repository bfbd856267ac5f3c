"""One word for one thing in what users read, and none of the sentences that nobody understood."""

import ast
import re
from pathlib import Path

import pytest
from docs_pages import ROOT

# What is not written -> what is. Keys and columns such as plan.n_units and specimen_id are no words
# of a sentence.
REFUSED = {
    r"\bsound(?! of\b)\b": "healthy",
    r"\bspecimens?\b": "set of gears",
    r"\b(test|validation|unseen|every|each|of the same|once an?|more|many|few) units?\b"
    r"(?! loads?\b)": "machine",
    r"\bunits (never|not|that|share|on|apart)\b": "machines",
    r"(says?|said) what \S+ (says|said)|is said of all|is asked by|which is no example": (
        "a plain sentence"
    ),
    r"\bis not slow and light\b|\bwhat to source so that\b|\bthe more so the\b": (
        "a plain sentence"
    ),
}
# A specimen of a measured set is a key of its facts; realism.md is beside such sets, and the others
# hold printed words of papers or of other programs.
OF_MEASURED = (
    "gensig/measured/",
    "gensig/commands/sets/measured.py",
    "diagnose/bridge/",
)
OTHER_PAGES = ("realism.md", "reliability.md")


def refused(text: str) -> list[str]:
    """Refused words of a text, each with the one to write."""
    return [
        f"{found.group()}: write {word}"
        for pattern, word in REFUSED.items()
        for found in re.finditer(pattern, text, re.IGNORECASE)
    ]


def prose(page: str) -> str:
    """A Markdown page without code, links and the column of units of its tables."""
    page = re.sub(r"^\s*```.*?^\s*```", "", page, flags=re.DOTALL | re.MULTILINE)
    page = re.sub(r"`[^`]*`|\]\([^)]*\)|<[^>]*>|\*\*Sound\*\*", "", page)
    return " ".join(page.split())


def sentences(path: Path) -> list[str]:
    """Texts of a module with a blank, less those of docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    owners = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, owners) and node.body and isinstance(node.body[0], ast.Expr)
    }
    return [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and " " in node.value
        and id(node) not in docstrings
    ]


def comments(option: str) -> str:
    """Comments of an option file, joined."""
    found = re.findall(r"(?:^|\s)# *(.*)$", option, re.MULTILINE)
    return " ".join(found)


PAGES = [
    path
    for path in sorted((ROOT / "docs").rglob("*.md"))
    if path.name not in OTHER_PAGES and "validation" not in str(path.relative_to(ROOT))
]
MODULES = [
    path
    for folder in ("gensig", "diagnose")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if not path.relative_to(ROOT).as_posix().startswith(OF_MEASURED)
]
OPTIONS = sorted((ROOT / "configs").rglob("*.yaml"))


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_has_one_word_for_one_thing(path: Path) -> None:
    assert refused(prose(path.read_text(encoding="utf-8"))) == []


def test_messages_have_one_word_for_one_thing() -> None:
    found = {
        path.relative_to(ROOT).as_posix(): words
        for path in MODULES
        if (words := [word for text in sentences(path) for word in refused(text)])
    }
    assert found == {}


def test_options_have_one_word_for_one_thing() -> None:
    found = {
        path.name: words
        for path in OPTIONS
        if (words := refused(comments(path.read_text(encoding="utf-8"))))
    }
    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        "Each machine also has a sound reference record.",
        "protocol by_unit is left out: says what new_machine says",
        "A specimen is a set of gears.",
        "judged on test units",
        "units never seen",
        "off by 0.1, by 0.2 if its usual one is said of all",
        '"elsewhere" is not slow and light, here all records',
        "what to source so that the tab key completes both commands",
    ],
)
def test_a_refused_word_would_be_found(text: str) -> None:
    assert refused(prose(text))


@pytest.mark.parametrize(
    "text",
    [
        "`plan.n_units` machines, `sound_record` beside them",
        "every key ends in its unit; unit loads of 10 N/mm2",
        "spectrogram and sound of records",
        "the column `specimen_id`",
    ],
)
def test_keys_and_other_meanings_are_left_alone(text: str) -> None:
    assert refused(prose(text)) == []
