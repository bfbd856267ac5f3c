"""The page of a data set in headless Chromium: no errors, and each control does what it says.

It is skipped without a Chromium; the fixture ``browser`` says what it needs.
"""

import re

import numpy as np
import pytest
from dataset_samples import ATTRIBUTES, build, whole_conditions
from offline_pages import NOTHING, sent_by

from gensig.report.document import write_report

HOSTILE = '<a href="https://example.org">x</a></script><img src=x onerror=alert(1)>'
TRACES = "name => document.getElementById('plot-' + name).data.map(t => t.name)"
AXIS = "name => document.getElementById('plot-' + name).layout.xaxis.title.text"


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """A page of 36 records with twins and two channels, one of them with a hostile name."""
    attributes = {
        **ATTRIBUTES,
        "channel_names": ["pinion_y", HOSTILE],
        "channel_units": ["m/s^2", "rad/s"],
    }
    severity = 0.05 * np.arange(36.0) / 2 * (np.arange(36) % 3 > 0)
    plan = whole_conditions(36, severity=severity)
    folder = tmp_path_factory.mktemp("page") / "set"
    build(folder, plan, attributes=attributes, twin=True)
    return write_report(folder, folder.parent / "page.html")[0]


WINDOW = {"viewport": {"width": 1280, "height": 900}}
OPTIONS = {
    "desktop": WINDOW,
    "phone": {
        "viewport": {"width": 390, "height": 844},
        "is_mobile": True,
        "has_touch": True,
    },
    "dark": {**WINDOW, "color_scheme": "dark"},
}


@pytest.fixture(params=OPTIONS)
def page(browser, page_file, request):
    context = browser.new_context(**OPTIONS[request.param])
    page = context.new_page()
    said, asked = [], []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(page_file.as_uri())
    page.wait_for_selector("#plot-spectrogram .main-svg")
    yield page
    assert said == []
    assert asked == [page_file.as_uri()]
    context.close()


def layout(page, plot, path):
    """A value of the layout of a plot."""
    return page.evaluate(f"document.getElementById('plot-{plot}').layout.{path}")


def drawn(page, plot, path):
    """A value of the first curve of a plot."""
    return page.evaluate(f"document.getElementById('plot-{plot}').data[0].{path}")


def test_it_loads_and_fits(page):
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.evaluate("document.querySelectorAll('.plot .main-svg').length") >= 6
    assert (
        page.evaluate("document.querySelectorAll('img, svg a').length") == 0
    )  # no text became markup


def test_legends_are_clear_of_the_drawing(page):
    """Below it."""
    box = (
        "([plot, part]) => document.querySelector(`#plot-${plot} "
        "${part}`).getBoundingClientRect().toJSON()"
    )
    legend, drawing, whole = (
        page.evaluate(box, ["indicators", part])
        for part in (".legend", ".nsewdrag", ".main-svg")
    )
    assert drawing["bottom"] <= legend["top"] <= legend["bottom"] <= whole["bottom"] + 1


def test_it_fetches_nothing_and_has_no_button_that_sends(browser, page_file):
    assert sent_by(browser, page_file) == NOTHING


def test_a_button_that_sends_and_a_fetch_would_be_seen(browser, page_file, tmp_path):
    """The page with the library's own choice of buttons, a picture from elsewhere and no policy."""
    text = page_file.read_text(encoding="utf-8")
    text = text.replace("displayModeBar: false", 'displayModeBar: "hover"')
    text = text.replace("showSendToCloud: false", "showSendToCloud: true")
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    text = text.replace("</main>", '<img src="https://example.org/x.png"></main>')
    changed = tmp_path / "page.html"
    changed.write_text(text, encoding="utf-8")
    seen = sent_by(browser, changed)
    assert seen["asked"] == ["https://example.org/x.png"]
    assert set(seen["ways_out"]) == {*seen["asked"], "https://plotly.com/"}
    assert seen["buttons"] > 5


def test_record_channel_and_comparison(page):
    form = "#signals-controls"
    for value in ("1", "5"):
        page.select_option(f"{form} [name=record]", value)
        expected = page.evaluate(
            "i => JSON.parse(document.getElementById('data').textContent).examples[i].record",
            value,
        )
        assert expected in page.evaluate(TRACES, "wave")[-1]
        assert expected in page.inner_text("#signals-said")
        other = page.eval_on_selector_all(
            f"{form} [name=other] option", "options => options.map(o => o.value)"
        )
        condition = set(range(3 * (int(value) // 3), 3 * (int(value) // 3) + 3))
        assert {int(k) for k in other if k} == condition - {int(value)}
        assert len(page.evaluate(TRACES, "wave")) == 2
        assert page.evaluate(TRACES, "turn")[-1] == "difference"
    page.select_option(f"{form} [name=other]", "")
    assert len(page.evaluate(TRACES, "wave")) == 1
    assert len(page.evaluate(TRACES, "turn")) == 1
    first = drawn(page, "wave", "y[7]")
    page.select_option(f"{form} [name=channel]", "1")
    assert drawn(page, "wave", "y[7]") != first
    assert HOSTILE in page.inner_text("#signals-said")
    assert "rad/s" in layout(page, "spectrum", "yaxis.title.text")


def test_axes_marks_and_zoom(page):
    """690 Hz of mesh and 23 teeth: the mesh stands at order 23 of the pinion."""
    form = "#signals-controls"
    page.select_option(f"{form} [name=record]", "4")
    page.select_option(f"{form} [name=other]", "")
    marked = (
        "name => document.getElementById('plot-envelope').data"
        ".find(t => t.name === name)?.x.filter(x => x !== null)[0]"
    )
    assert page.evaluate(AXIS, "spectrum") == "frequency, Hz"
    assert page.evaluate(marked, "fault frequency") == pytest.approx(30.0)
    page.select_option(f"{form} [name=axis]", "pinion")
    assert page.evaluate(AXIS, "spectrum") == "orders of the pinion"
    assert page.evaluate(AXIS, "wave") == "turns of the pinion"
    assert page.evaluate(marked, "fault frequency") == pytest.approx(1.0)
    page.select_option(f"{form} [name=axis]", "mesh")
    assert page.evaluate(marked, "fault frequency") == pytest.approx(1 / 23)
    for name, label in (("shafts", "shaft orders"), ("fault", "fault frequency")):
        box = page.locator(f"{form} [name={name}]")
        before = box.is_checked()
        box.focus()
        page.keyboard.press("Space")  # by keyboard alone
        assert (label in page.evaluate(TRACES, "envelope")) is not before
    page.locator(f"{form} [name=decibel]").uncheck()
    assert layout(page, "spectrum", "yaxis.type") == "linear"
    page.select_option(f"{form} [name=axis]", "hz")
    whole = layout(page, "spectrum", "xaxis.range")
    page.select_option(f"{form} [name=zoom]", "1")
    assert layout(page, "spectrum", "xaxis.range") != whole


def test_parameters_and_indicators(page):
    page.select_option("#parameters-controls [name=column]", "params/crack_depth_mm")
    assert page.evaluate(TRACES, "parameters") == ["crack"]
    page.select_option("#parameters-controls [name=column]", "speed_rpm")
    assert page.evaluate(TRACES, "parameters") == ["healthy", "crack", "pitting"]
    page.select_option("#parameters-controls [name=form]", "boxes")
    assert drawn(page, "parameters", "type") == "box"
    page.select_option("#indicators-controls [name=indicator]", "kurtosis")
    page.select_option("#indicators-controls [name=along]", "speed_rpm")
    assert page.evaluate(AXIS, "indicators") == "speed, r/min"
    first = drawn(page, "indicators", "y[0]")
    page.select_option("#indicators-controls [name=channel]", "1")
    assert drawn(page, "indicators", "y[0]") != first
    page.locator("#indicators-controls [name=decibel]").check()
    assert layout(page, "levels", "yaxis.type") == "log"


def test_the_difference_is_that_of_the_two_turns(page):
    """The page opens on a fault over its healthy record."""
    values = page.evaluate(
        "() => document.getElementById('plot-turn').data.map(t => Array.from(t.y))"
    )
    healthy, fault, difference = (np.array(line) for line in values)
    np.testing.assert_allclose(difference, fault - healthy, rtol=0, atol=1e-12)
    assert np.abs(difference).max() > 0.1
    first, second, _ = page.evaluate(TRACES, "turn")
    assert first.startswith("healthy")
    assert not second.startswith("healthy")


def test_sounds_are_those_of_the_records_shown(page):
    heard = page.evaluate(
        """async () => Promise.all(['record', 'other'].map(name => new Promise(done => {
            const player = document.getElementById('sound-' + name);
            player.addEventListener('loadedmetadata', () => done(player.duration));
            player.addEventListener('error', () => done(-1));
            player.load();
        })))"""
    )
    assert heard == pytest.approx([0.2, 0.2], abs=1e-3)
    before = page.get_attribute("#sound-record", "src")
    page.select_option("#signals-controls [name=record]", "5")
    assert page.get_attribute("#sound-record", "src") != before
    page.select_option("#signals-controls [name=other]", "")
    assert not page.is_visible("#sound-other")


def test_the_slider_steps_by_keyboard_and_says_the_severity(page):
    slider = page.locator("#severity-controls [name=step]")
    slider.focus()
    said = []
    for _ in range(3):
        page.keyboard.press("ArrowRight")
        said.append(page.inner_text("#severity-said"))
        assert slider.get_attribute("aria-valuetext") in said[-1]
    assert len(set(said)) == 3
    assert "(4 of 12)" in said[-1]
    assert page.evaluate(TRACES, "step_turn")[-1] == "difference"
    assert len(page.evaluate("document.getElementById('plot-step_wave').data")) == 1
    page.select_option("#severity-controls [name=class]", "1")
    assert "pitting" in page.inner_text("#severity-said")
