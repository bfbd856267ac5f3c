"""Links, figures, equations, navigation and configuration keys of the pages."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from docs_pages import (
    NAMES,
    PAGES,
    ROOT,
    anchors,
    blocks,
    command_lines,
    without_blocks,
)

from gensig.options.compose import compose

DOCS = ROOT / "docs"
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
FILES = (
    ".csv",
    ".html",
    ".json",
    ".md",
    ".png",
    ".py",
    ".safetensors",
    ".yaml",
)  # no keys, though they look like some
TAG = re.compile(r"\\tag\{([A-Z]+)\.(\d+)\}")


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_every_link_leads_somewhere(page: Path) -> None:
    wrong = []
    for _, _, target in LINK.findall(without_blocks(page.read_text(encoding="utf-8"))):
        if "://" in target or target.startswith("mailto:"):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        if not there.exists() or not there.is_relative_to(ROOT):
            wrong.append(target)
        elif anchor and anchor not in anchors(there.read_text(encoding="utf-8")):
            wrong.append(f"{target}: no such heading")
    assert not wrong


def test_every_figure_has_an_alternative_text() -> None:
    texts = [
        (page.name, text)
        for page in PAGES
        for image, text, _ in LINK.findall(page.read_text(encoding="utf-8"))
        if image
    ]
    assert len(texts) > 10
    assert not [(name, text) for name, text in texts if len(text.split()) < 2]


def test_the_site_has_every_page_once() -> None:
    def leaves(node: Any) -> list[str]:
        if isinstance(node, str):
            return [node]
        return [
            leaf
            for item in (node.values() if isinstance(node, dict) else node)
            for leaf in leaves(item)
        ]

    nav = leaves(
        yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    )
    pages = [str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")]
    assert sorted(nav) == sorted([*pages, "tour.md"])  # made of tour.ipynb


@pytest.mark.parametrize(
    "page", sorted(DOCS.glob("theory/*.md")), ids=lambda page: page.name
)
def test_equations_are_numbered_in_order(page: Path) -> None:
    equations = [
        block.code
        for block in blocks(page.read_text(encoding="utf-8"))
        if block.language == "math"
    ]
    tags = [TAG.findall(code) for code in equations]
    assert all(len(tag) == 1 for tag in tags)
    assert len({letter for ((letter, _),) in tags}) <= 1
    assert [int(number) for ((_, number),) in tags] == list(range(1, len(tags) + 1))


def test_equations_that_the_text_names_exist_once() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    tags = [f"{letter}.{number}" for letter, number in TAG.findall(text)]
    assert len(tags) > 40
    assert len(set(tags)) == len(tags)
    assert set(re.findall(r"\(([A-Z]{1,2}\.\d+)\)", text)) <= set(tags)


def test_a_list_or_block_is_not_taken_for_the_paragraph_before() -> None:
    """Markdown of the site, unlike that of a code forge, wants an empty line there."""
    wrong = []
    for page, name in zip(PAGES, NAMES, strict=True):
        lines = page.read_text(encoding="utf-8").split("\n")
        for number, (before, line) in enumerate(pairwise(lines), start=2):
            begins = (
                re.match(r"(- |\* |1\. |\|)", line)
                and before.strip()
                and not before.startswith(("#", "<!--"))
            )
            if begins and not re.match(r"( *- | *\* | *\d+\. |\||  )", before):
                wrong.append(f"{name}:{number}: {line[:40]}")
    assert not wrong


def _keys(tree: Any, prefix: str) -> set[str]:
    """Dotted keys of a mapping, with those of mappings within."""
    result: set[str] = set()
    for key, value in tree.items() if isinstance(tree, dict) else ():
        result |= {f"{prefix}{key}"} | _keys(value, f"{prefix}{key}.")
    return result


def test_configuration_keys_that_the_pages_name_exist() -> None:
    known: set[str] = set()
    for file in (ROOT / "configs").rglob("*.yaml"):
        text = file.read_text(encoding="utf-8")
        group = (
            file.relative_to(ROOT / "configs").parts[0]
            if file.parent.name != "configs"
            else ""
        )
        known |= _keys(
            yaml.safe_load(text),
            "" if not group or "@package _global_" in text else f"{group}.",
        )
    for life in (
        "crack_growth",
        "pit_growth",
        "wear",
        "mixed",
    ):  # put together from several files
        known |= _keys(
            compose("generate", ["experiment=run_to_failure", f"life={life}"]).plain(),
            "",
        )
    sections = {key.partition(".")[0] for key in known if "." in key}
    named = re.compile(
        rf"(?<![\w./{{$])((?:{'|'.join(sorted(sections))})(?:\.[a-z][a-z0-9_]*)+)(?![\w/(*.|])"
    )
    unknown = set()
    n_named = 0
    for page, name in zip(PAGES, NAMES, strict=True):
        if name == "CHANGELOG.md":  # names keys that were
            continue
        for code in re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8")):
            for key in named.findall(code):
                if key.endswith(FILES):
                    continue
                n_named += 1
                if key not in known:
                    unknown.add(f"{name}: {key}")
    assert n_named > 200
    assert not unknown


def test_a_page_is_cut_where_it_should_be() -> None:
    page = (
        "# A `b` c\n\ntext `[no](link.md)` [yes](other.md#x)\n\n"
        "    gensig plan fault=crack  # note\n\n- item\n\n    no block\n\nend\n\n"
        "<!-- not run: why -->\n\n```python\n[no](link.md)\n```\n\n"
        "## Twice\n\n## Twice\n"
    )
    indented, fenced = blocks(page)
    assert (indented.language, indented.line, fenced.language, fenced.mark) == (
        "",
        5,
        "python",
        "not run: why",
    )
    assert [target for _, _, target in LINK.findall(without_blocks(page))] == [
        "other.md#x"
    ]
    assert anchors(page) == {"a-b-c", "twice", "twice-1"}
    assert list(command_lines(page)) == [(5, ["gensig", "plan", "fault=crack"])]


def test_the_architecture_page_links_every_example() -> None:
    """Files of tests/examples run in tests of their own; links that lead nowhere fail above."""
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    linked = {target for _, _, target in LINK.findall(page)}
    examples = (ROOT / "tests" / "examples").iterdir()
    files = {
        f"../tests/examples/{path.name}"
        for path in examples
        if path.is_file() and not path.name.startswith("test_")
    }
    assert files <= linked


@pytest.mark.parametrize("package", ["gensig", "diagnose"])
def test_the_architecture_page_shows_every_folder_and_module(package: str) -> None:
    """Of the top level; `moved` holds the paths of earlier versions alone."""
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    picture = (
        page.partition(f"\n{package}/\n")[2].partition("\n\n")[0].partition("\n```")[0]
    )
    first = re.findall(r"^  (\w\S*(?: \w\S*)*)", picture, re.MULTILINE)
    files = {path.stem for path in (ROOT / package).glob("[!_]*.py")} - {"moved"}
    folders = {
        f"{path.parent.name}/" for path in (ROOT / package).glob("*/__init__.py")
    }
    assert set(" ".join(first).split()) == files | folders
