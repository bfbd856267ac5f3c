"""Pages name nothing outside of them, whatever their parts; one module makes every page."""

import re
from pathlib import Path

import pytest
from offline_pages import outward

from gensig.text.page import Card, Section, Table, write_page

ROOT = Path(__file__).resolve().parents[3]
# modules that make a page; a test of each opens its page in a browser
MAKERS = {
    "diagnose/bridge/bridge_page.py",
    "diagnose/report/base.py",
    "gensig/report/document.py",
}
TEXT = "see https://example.org <img src=https://example.org/x.png>"


@pytest.fixture
def text(tmp_path):
    """A page with every part that a page without scripts can have."""
    (tmp_path / "a.png").write_bytes(b"\x89PNG")
    card = Card(title=TEXT, value="1", spread=TEXT, verdict=TEXT, meaning=TEXT)
    section = Section(
        title=TEXT,
        text=[TEXT],
        cards=[card],
        table=Table(head=[TEXT], rows=[[TEXT]]),
        notes=[(TEXT, TEXT)],
        figures=[("a.png", TEXT)],
        code=TEXT,
    )
    path = tmp_path / "page.html"
    write_page(path, title=TEXT, lead=[TEXT], sections=[section], program="test")
    return path.read_text(encoding="utf-8")


def test_no_part_of_a_page_names_an_address(text):
    assert outward(text) == []
    assert text.count("example.org") > 10


@pytest.mark.parametrize(
    "part",
    [
        '<img src="https://example.org/x.png">',
        '<a href="//example.org">x</a>',
        '<script src="plotly.js"></script>',
        '<link rel="stylesheet" href="site.css">',
        '<form action="https://example.org"></form>',
        "<style>@import 'a.css';</style>",
        "<style>p { background: url(https://example.org/x.png) }</style>",
        '<p style="background: url(x.png)"></p>',
    ],
)
def test_an_address_in_a_page_would_be_seen(text, part):
    assert len(outward(text.replace("</main>", part + "</main>"))) == 1


def test_a_page_without_its_policy_would_be_seen(text):
    assert outward(re.sub("default-src 'none'", "default-src *", text))


def test_the_makers_of_pages_are_those_whose_pages_are_opened():
    call = re.compile(r"\b(write_page|interactive_page)\(\n? +")
    files = [
        path for part in ("gensig", "diagnose") for path in (ROOT / part).rglob("*.py")
    ]
    makers = {
        path.relative_to(ROOT).as_posix()
        for path in files
        if call.search(path.read_text(encoding="utf-8"))
    }
    assert makers - {"gensig/text/page.py"} == MAKERS
    markup = [path for path in files if "<html" in path.read_text(encoding="utf-8")]
    assert markup == []
    templates = {path.name for path in (ROOT / "gensig/text/templates").iterdir()}
    assert templates == {"page.html", "dataset_report.js"}
