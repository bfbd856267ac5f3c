"""The report page: one file, facts from the data set, and no text taken for markup."""

import base64
import hashlib
import html
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from dataset_samples import ATTRIBUTES, build, forge, setting
from numpy.testing import assert_allclose
from offline_pages import outward

from gensig.cli import main
from gensig.dataset.folder.verify import verify as verify_folder
from gensig.errors import ConfigError, DatasetError
from gensig.report.conditions import choose
from gensig.report.document import write_report
from gensig.report.examples import _lines
from gensig.report.levels import class_levels, level_table, loudness, velocity_rms
from gensig.report.packing import STEP_DB, pack_amplitude, pack_signal
from gensig.report.rotation_frequencies import Rotation, read_rotation
from gensig.report.values import Measured, some_records
from gensig.signals.spectrum import amplitude_spectrum

HOSTILE = "</script><img src=x onerror=alert(1)>&amp;"


class Page(HTMLParser):
    """Tags of a page, and the text behind each, as a browser reads them."""

    def __init__(self, text):
        super().__init__()
        self.text = text
        self.tags = []
        self.pieces = [["", {}, ""]]
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.pieces.append([tag, dict(attrs), ""])

    def handle_endtag(self, tag):
        self.pieces.append(["", {}, ""])

    def handle_data(self, data):
        self.pieces[-1][2] += data

    def all(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]

    def scripts(self, kind=None):
        scripts = [piece for piece in self.pieces if piece[0] == "script"]
        return [text for _, result, text in scripts if result.get("type") == kind]

    @property
    def data(self):
        return json.loads(*self.scripts("application/json"))


def decoded(text, dtype):
    """Packed numbers as the page's script reads them."""
    return np.frombuffer(base64.b64decode(text), dtype=dtype)


def page_of(folder, out):
    return Page(write_report(folder, out)[0].read_text(encoding="utf-8"))


def unpack(packed):
    """Amplitudes as the page's script reads them."""
    counts = decoded(packed["n"], "u1").astype(float)
    decibels = (counts - 255.0) * packed["step_db"]
    return np.where(counts > 0, packed["top"] * 10.0 ** (decibels / 20.0), 0.0)


@pytest.fixture(scope="module")
def made(template, tmp_path_factory):
    """A data set without a folder of figures, and its page."""
    return template, page_of(template, tmp_path_factory.mktemp("report") / "page.html")


def n_signals(chosen):
    return len(chosen.channels) * len(list(chosen.all_shown))


def replace_column(data, name, values):
    """Give a reader other values of a column."""
    column = data.column
    data.column = lambda wanted: values if wanted == name else column(wanted)


def test_the_page_stands_alone(made):
    _folder, page = made
    assert len(page.text.encode()) < 7e6
    assert outward(page.text) == []
    for tag, attributes in page.tags:
        assert tag not in ("link", "iframe", "object", "embed", "base", "img")
        assert not [name for name in attributes if name.startswith("on")], tag


def test_every_chart_has_the_settings_without_buttons(made):
    """The library's bar holds a button that sends the chart to a cloud service."""
    library, ours = made[1].scripts()
    assert "showSendToCloud" in library
    calls = re.findall(r"Plotly\.\w+\((.*)\);", ours)
    assert calls
    assert all(call.endswith(", CONFIG") for call in calls)
    (settings,) = re.findall(r"const CONFIG = (.*);", ours)
    for one in ("displayModeBar: false", "showSendToCloud: false"):
        assert one in settings


def test_only_its_own_scripts_may_run(made):
    metas = {meta.get("http-equiv"): meta for meta in made[1].all("meta")}
    policy = metas["Content-Security-Policy"]["content"]
    assert policy.startswith("default-src 'none'; script-src ")
    digests = [hashlib.sha256(text.encode()) for text in made[1].scripts()]
    codes = [base64.b64encode(digest.digest()).decode() for digest in digests]
    assert len(set(codes)) == 2
    allowed = policy.split("script-src ")[1].split(";")[0].split()
    assert set(allowed) == {f"'sha256-{code}'" for code in codes}


def test_structure(made):
    page = made[1]
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert all(link["href"][1:] in ids for link in page.all("a"))
    assert page.all("html") == [{"lang": "en"}]
    assert any(meta.get("name") == "viewport" for meta in page.all("meta"))
    assert len(page.all("h1")) == 1
    assert len(page.all("h2")) >= 9
    names = [tag for tag, _ in page.tags]
    for number, (tag, attributes) in enumerate(page.tags):
        if tag in ("select", "input"):  # every control stands in its label
            assert names[number - 1] == "label", attributes
        if "role" in attributes:
            assert attributes["aria-label"]
    divs = [attributes for _, attributes in page.tags]
    plots = {result["id"] for result in divs if result.get("class") == "plot"}
    signals = ("turn", "wave", "spectrum", "envelope", "spectrogram")
    shown = (*signals, "parameters", "indicators")
    assert {f"plot-{name}" for name in shown} <= plots


def test_charts_come_first_and_tables_of_facts_are_folded(made):
    page = made[1]
    first_plot = page.text.index('class="plot"')
    for title in ("What is in it", "Classes", "Splits", "Where it is from"):
        assert re.search(rf"<details[^>]*><summary><h2>{title}</h2>", page.text)
        assert page.text.index(f"<h2>{title}</h2>") > first_plot
    unfolded = re.sub(r"<details.*?</details>", "", page.text, flags=re.DOTALL)
    assert "<table" in page.text
    assert "<table" not in unfolded


def test_every_option_has_its_data(made, plan):
    page, data = made[1], made[1].data
    options = page.all("option")
    values = [attributes.get("value") for attributes in options]
    examples = data["examples"]
    assert set(map(str, range(len(examples)))) <= set(values)
    assert set(data["drawn"]["columns"]) <= set(values)
    assert (
        {len(result["views"]) for result in examples} == {2} == {len(data["channels"])}
    )
    views = set(examples[0]["views"][0])
    assert views == {"wave", "spectrum", "envelope", "spectrogram"}
    for table in (data["drawn"], data["measured"]):
        assert len(decoded(table["class"], "u1")) == table["rows"] == 36
    name = "params/crack_depth_mm"
    column = decoded(data["drawn"]["columns"][name], "<f4")
    assert_allclose(column, plan.columns[name], rtol=1e-6, atol=0)


def test_the_signals_are_those_of_the_records(made, data):
    ids = data.column("record_id").tolist()
    for example in made[1].data["examples"]:
        signal = data.signals(ids.index(example["record"]))[1].astype(float)
        view = example["views"][1]
        shown = decoded(view["wave"]["n"], "<i2") * view["wave"]["scale"]
        peak = np.abs(signal).max()
        assert_allclose(shown, signal, rtol=0, atol=peak / 32000)
        packed = view["spectrum"]
        frequency, amplitude = amplitude_spectrum(signal, data.sampling_rate)
        amplitude = amplitude[frequency <= 400.0]  # the usable band
        half_step = 10 ** (0.55 * STEP_DB / 20) - 1
        assert_allclose(unpack(packed), amplitude, rtol=half_step, atol=0)
        assert packed["start"] == 0.0
        assert packed["step"] == pytest.approx(frequency[1])


def test_of_many_bins_the_largest_is_kept():
    amplitude = np.full(1001, 1e-3)
    amplitude[347] = 5.0
    packed = _lines(np.arange(1001) * 0.5, amplitude, 500.0, 100)
    result = unpack(packed)
    assert result.max() == pytest.approx(5.0)
    at = packed["start"] + packed["step"] * result.argmax()
    assert abs(at - 347 * 0.5) <= packed["step"] / 2


def test_a_silent_signal_is_packed():
    assert not unpack(pack_amplitude(np.zeros(5))).any()
    assert pack_signal(np.zeros(5))["scale"] == 0.0


def test_text_of_the_files_is_no_markup(tmp_path, plan):
    names = {
        "channel_names": [HOSTILE, "wheel_y"],
        "channel_units": ["m/s^2", "<s>rad</s>"],
    }
    attributes = ATTRIBUTES | names
    folder = build(tmp_path / "a<script>alert(1)<", plan, attributes=attributes)
    page = page_of(folder, tmp_path / "page.html")
    assert len(page.all("script")) == 3
    assert not page.all("img") + page.all("s")
    assert page.data["channels"][0]["name"] == HOSTILE
    assert any(HOSTILE in text for tag, _, text in page.pieces if tag != "script")


def test_the_code_on_the_page_runs(made, monkeypatch):
    folder, page = made
    (code,) = re.findall(r"<code>(import gensig.*?)</code>", page.text, flags=re.DOTALL)
    code = html.unescape(code).replace("PATH/TO/THIS/FOLDER", str(folder))
    names = {}
    exec(compile(code, "page", "exec"), names)
    assert len(names["mine"]) == 12
    assert names["signal"].shape == (2, 200)


def test_what_does_not_fit_is_left_out_and_said(data):
    chosen = choose(data, 300)
    assert n_signals(chosen) <= 100
    chosen = choose(data, None)
    assert n_signals(chosen) <= 48
    assert chosen.remark == ""
    data.channel_names = [f"c{i}" for i in range(40)]
    chosen = choose(data, None)
    assert n_signals(chosen) <= 48
    assert "of 40 channels" in chosen.remark


def test_few_of_many_records_are_of_all_classes(data):
    """Classes are dealt in turn, so that every k-th record could be of one class alone."""
    some = some_records(data, 12)
    assert np.bincount(data.column("label")[some]).tolist() == [4, 4, 4]


@pytest.mark.parametrize(
    ("drive", "references"),
    [(5.0, ["pinion", "wheel", "drive", "mesh"]), (10.0, ["pinion", "wheel", "mesh"])],
)
def test_frequencies_of_a_geared_engine(drive, references):
    """A crank that turns with a gear is no reference of its own."""
    rotation = Rotation(
        mesh=np.array([100.0, np.nan]),
        drive=np.array([drive, np.nan]),
        n_teeth={"pinion": 10, "wheel": 40},
        further={},
        gear=np.array(["wheel", ""]),
    )
    expected = {"mesh": 100.0, "drive": drive, "pinion": 10.0, "wheel": 2.5}
    result = rotation.of(0)
    assert result == {name: expected[name] for name in result}
    assert set(result) >= set(references)
    assert set(rotation.of(1).values()) == {None}
    assert [name for name, _ in rotation.references] == references
    assert rotation.fault_gear(0) == "wheel"


def test_the_page_in_the_folder_leaves_the_set_whole(tmp_path, plan, capsys):
    folder = build(tmp_path / "set", plan, failed=4)
    assert main(["report", str(folder), "--records", "1"]) == 0
    assert "4 records shown, 35 measured" in capsys.readouterr().out
    assert not verify_folder(folder).problems
    once = (folder / "report.html").read_text(encoding="utf-8")
    assert main(["report", str(folder), "--records", "3"]) == 0
    assert "records shown" in capsys.readouterr().out
    again = (folder / "report.html").read_text(encoding="utf-8")
    assert len(Page(again).data["examples"]) > len(Page(once).data["examples"])
    assert not verify_folder(folder).problems
    assert not list(folder.glob(".*report*"))


@pytest.mark.parametrize(
    "content",
    [
        "<!doctype html><title>mine</title>",
        "",
        '<meta name="generator" content="diagnose train">',
        " " * 2000 + '<meta name="generator" content="gensig report">',
    ],
)
def test_a_file_of_another_program_is_kept(template, tmp_path, content, capsys):
    page = tmp_path / "page.html"
    page.write_text(content)
    assert main(["report", str(template), "--out", str(page)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "does not say that gensig report wrote it" in said
    assert page.read_text() == content


def test_a_link_is_kept_even_to_a_page(made, tmp_path):
    target, link = tmp_path / "target.html", tmp_path / "link.html"
    target.write_text(made[1].text, encoding="utf-8")
    link.symlink_to(target)
    with pytest.raises(ConfigError, match="remove it"):
        write_report(made[0], link)
    assert target.read_text(encoding="utf-8") == made[1].text


@pytest.mark.parametrize(
    "lost",
    ["manifest.json", "shards/shard-00001.h5", "splits/by_unit.csv", "config.yaml"],
)
def test_a_damaged_set_is_one_clear_line(tmp_path, folder, lost):
    (folder / lost).unlink()
    with pytest.raises(DatasetError, match=Path(lost).name) as caught:
        write_report(folder, tmp_path / "page.html")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "page.html").exists()


def test_an_incomplete_set_and_bad_options_are_refused(tmp_path, plan):
    begun = build(tmp_path / "begun", plan, shards=range(1), close=False)
    with pytest.raises(DatasetError, match="gensig resume"):
        write_report(begun, tmp_path / "page.html")
    with pytest.raises(ConfigError, match="at least 1"):
        write_report(begun, tmp_path / "page.html", per_class=0)
    with pytest.raises(ConfigError, match="no folder"):
        write_report(begun, tmp_path / "nowhere" / "page.html")


def test_values_that_are_not_finite_are_refused(folder, tmp_path):
    forge(folder, 0, setting("acceleration", slice(None), np.nan))
    with pytest.raises(DatasetError, match="not finite"):
        write_report(folder, tmp_path / "page.html")


def test_a_fault_of_all_teeth_has_no_frequency_of_its_own(data):
    assert read_rotation(data).fault_gear(1) == "pinion"
    replace_column(data, "fault_tooth", np.full(36, -1))
    assert read_rotation(data).fault_gear(1) == ""


def test_velocity_of_a_tone_is_its_acceleration_over_its_frequency():
    angle = 2 * np.pi * np.arange(51200) / 51200.0
    inside, outside = (100.25, 950.5), (5.0, 1500.0)  # of 10 to 1000 Hz
    tones = [3.0 * np.sin(f * angle + 0.3) for f in inside + outside]
    # neither end of the last is 0: nothing of it leaks below 1 kHz
    velocity = velocity_rms(np.stack([*tones, 40.0 * np.cos(3000.7 * angle)]), 51200.0)
    expected = 3.0 / np.sqrt(2.0) / (2 * np.pi * np.array(inside))
    assert_allclose(velocity[:2], expected, rtol=2e-3)
    assert velocity[2:4].max() < 0.02 * 3.0 / (2 * np.pi * 10.0)
    assert velocity[4] < 1e-6


def test_levels_are_stated_in_g_and_mm_s_and_loud_ones_are_named(data):
    measured = Measured(
        records=np.arange(2),
        values={
            "rms": np.array([[97.0, 1.0], [98.1665, 1.0]]),
            "velocity_rms": np.array([[2e-3, 1.0], [4e-3, 1.0]]),
        },
    )
    replace_column(data, "label_name", np.array(["healthy", "crack"]))
    channels = ["case", "shaft"]

    def levels(*units):
        return class_levels(data, measured, channels, units)

    known = levels("m/s^2", "rad/s")
    rows = [list(row) for row in level_table(known).rows]
    healthy, crack = ["healthy", "case", "97", "9.89"], ["crack", "case", "98.2", "10"]
    assert rows == [[*healthy, "2"], [*crack, "4"]]
    (line,) = loudness(known)
    assert line.startswith("Louder than most published housings: crack. Above 10 g")
    measured.values["velocity_rms"][0, 0] = 12e-3
    (line,) = loudness(levels("m/s^2", "rad/s"))
    assert "housings: healthy, crack." in line
    assert level_table(levels("rad/s", "rad/s")) is None
