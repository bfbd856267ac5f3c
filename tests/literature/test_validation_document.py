"""Every printed figure and claim of the sources has its expected verdict, and
the pages on them are in step.
"""

import csv
import io
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from validation.markdown import markdown, shortfalls
from validation.pages import PAGES
from validation.rows import DIFFERS, FAILS, SOURCES, VERDICTS
from validation.verdicts import evaluate, run_validation

from gensig.cli import main

DOCS = Path(__file__).parents[2] / "docs"
MOST_WORDS = 1000
NUMBER = re.compile(r"(~)?[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?( %)?")


@pytest.fixture(scope="module")
def results():
    """All rows, judged once for all tests of this file."""
    return run_validation()


@pytest.mark.parametrize("source", SOURCES)
def test_rows_have_their_expected_verdicts(results, source):
    own = [result for result in results if result.row.origin == source]
    assert own
    wrong = [
        f"{result.row.id}, {result.row.source}: printed {result.row.printed} {result.row.unit}, "
        f"computed {result.computed:.6g}: {result.verdict}, expected {result.row.expected}"
        for result in own
        if not result.as_expected
    ]
    assert not wrong, "\n".join(wrong)


def out_of_step(written: str, computed: str) -> list[str]:
    """Lines whose words differ, or whose numbers differ by more than 0.1 %.

    Deviations in per cent may differ by 0.03 points. Numbers with a ~ are of a chaotic run, which
    the last bit scatters: 15 %, and 15 points.
    """
    old, new = written.splitlines(), computed.splitlines()
    wrong = []
    if len(old) != len(new):
        wrong.append(f"{len(old)} lines written, {len(new)} computed")
    for before, after in zip(old, new, strict=False):
        numbers = [list(NUMBER.finditer(line)) for line in (before, after)]
        same_words = NUMBER.sub("#", before) == NUMBER.sub("#", after)
        if not same_words or not all(map(_close, *numbers)):
            wrong.append(f"- {before}\n+ {after}")
    return wrong


def _close(old: re.Match[str], new: re.Match[str]) -> bool:
    a, b = (float(match[0].removesuffix(" %").lstrip("~")) for match in (old, new))
    is_rough, is_deviation = bool(old[1]), bool(old[2])
    rel_tol, abs_tol = {
        (False, False): (1e-3, 1e-9),
        (False, True): (2e-3, 0.03),
        (True, False): (0.15, 1e-9),
        (True, True): (0.15, 15.0),
    }[is_rough, is_deviation]
    return old[1] == new[1] and math.isclose(a, b, rel_tol=rel_tol, abs_tol=abs_tol)


@pytest.fixture(scope="module")
def pages(results):
    """Text of every page and CSV by its path in ``docs``."""
    return markdown(results)


def test_pages_are_in_step(pages):
    wrong = []
    for name, text in pages.items():
        written = (DOCS / name).read_text(encoding="utf-8")
        wrong += [f"{name}: {line}" for line in out_of_step(written, text)]
    assert not wrong, (
        "run: gensig validate --markdown docs/validation.md\n" + "\n".join(wrong[:5])
    )


def test_the_verb_writes_these_pages(results, pages, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("validation.verdicts.run_validation", lambda: results)
    page = tmp_path / "docs" / "validation.md"
    assert main(["validate", "--markdown", str(page)]) == 0
    written = {name: (page.parent / name).read_text("utf-8") for name in pages}
    assert written == pages
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("| spur_paper | ") for line in lines)


def test_rows_need_nothing_but_their_folder():
    """The command finds them as its user does, without the folders of these tests."""
    code = "from gensig.commands.validate import _of_checkout; _of_checkout('verdicts')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_no_other_page_is_there(pages):
    names = {path.name for path in (DOCS / "validation").iterdir()}
    assert names == {name.partition("/")[2] for name in pages if "validation/" in name}


def test_a_changed_page_is_noticed(pages):
    page = pages["validation/engine.csv"]
    rough = re.search(r",~(\d+),", page)[0]
    number = float(rough.strip(",~"))
    for old, new, wrong in (
        ("1.353", "1.363", 1),
        ("claim does not hold", "claim holds", 1),
        (rough, f",~{1.1 * number:.6g},", 0),
        (rough, f",~{1.3 * number:.6g},", 1),
        (rough, rough.replace("~", ""), 1),
    ):
        assert old in page
        assert len(out_of_step(page.replace(old, new, 1), page)) == wrong
    assert out_of_step(page + "\nmore", page)


def test_pages_can_be_read(pages):
    """At most 1,000 words a paper, and one table of the same width."""
    for name in PAGES:
        page = pages[f"validation/{name}.md"]
        assert len(re.findall(r"[^\s|]+", page)) <= MOST_WORDS, name
        tables = [line for line in page.splitlines() if line.startswith("| ")]
        assert {line.count("|") for line in tables} == {6}
    assert len(re.findall(r"[^\s|]+", pages["validation.md"])) < 800


def test_every_row_is_in_one_csv_and_every_shortfall_has_its_reason(results, pages):
    """In the CSV; those of the headlines on the page too."""
    seen = []
    for name, page in PAGES.items():
        rows = list(csv.DictReader(io.StringIO(pages[f"validation/{name}.csv"])))
        assert {row["source"] for row in rows} == set(page.sources)
        seen += [row["id"] for row in rows]
        text = " ".join(pages[f"validation/{name}.md"].split())
        for row in rows:
            line = row["id"].rpartition(".")[0]
            if row["verdict"] in (DIFFERS, FAILS):
                assert row["reason"].strip()
                told = " ".join(row["reason"].split()) in text and f"*{line}*" in text
                assert told or line not in page.headlines
    assert sorted(seen) == sorted(result.row.id for result in results)


def test_pages_are_deterministic_and_count_every_row(results, pages):
    again = list(results)
    again[::7] = [evaluate(result.row) for result in results[::7]]
    assert pages == markdown(again)
    for source in SOURCES:
        cells = re.search(rf"\| {source} \|(.*)\|", pages["validation.md"])[1].split(
            "|"
        )
        total, *counts = map(int, cells)
        rows = [result for result in results if result.row.origin == source]
        assert total == sum(counts) == len(rows)
        assert len(counts) == len(VERDICTS)


def test_shortfalls_are_listed_and_none_is_unexpected(results):
    lines = shortfalls(results)
    assert any(
        line.startswith(
            "pit.softens_less_than_crack.arc_mid: printed < 1, computed 1.425"
        )
        for line in lines
    )
    assert not [line for line in lines if line.startswith("UNEXPECTED")]
