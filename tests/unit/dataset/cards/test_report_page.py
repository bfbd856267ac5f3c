"""The report page: one file, facts from the data set, and no text taken for markup."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from dataset_samples import ATTRIBUTES, build, make_plan

from gensig.cli import main
from gensig.dataset.folder.verify import verify as verify_folder
from gensig.dataset.reader import Dataset, open_dataset
from gensig.errors import ConfigError, DatasetError
from gensig.report.document import write_report
from gensig.report.examples import choose
from gensig.report.levels import level_table, loudness, velocity_rms
from gensig.report.packing import STEP_DB, pack_amplitude, pack_signal
from gensig.report.rotation_frequencies import Rotation, read_rotation
from gensig.report.values import Measured, some_records
from gensig.signals.spectrum import amplitude_spectrum

HOSTILE = "</script><img src=x onerror=alert(1)>&amp;"


class Page(HTMLParser):
    """Tags, scripts and words of a page, as a browser reads them."""

    def __init__(self, text):
        super().__init__()
        self.text = text
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.words: list[str] = []
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.inside = tag
        if tag == "script":
            self.scripts.append((dict(attrs), ""))

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside == "script":
            attributes, before = self.scripts[-1]
            self.scripts[-1] = (attributes, before + data)
        elif self.inside != "style":
            self.words.append(data)

    def all(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]

    @property
    def data(self):
        (content,) = [
            text
            for attributes, text in self.scripts
            if attributes.get("type") == "application/json"
        ]
        return json.loads(content)


def page_of(folder, out):
    path, _said = write_report(folder, out)
    return Page(path.read_text(encoding="utf-8"))


def unpack(packed):
    """Amplitudes as the page's script reads them."""
    counts = np.frombuffer(base64.b64decode(packed["n"]), dtype="u1").astype(float)
    return np.where(
        counts > 0,
        packed["top"] * 10.0 ** ((counts - 255.0) * packed["step_db"] / 20.0),
        0.0,
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = build(
        tmp_path_factory.mktemp("report") / "set", make_plan()
    )  # without a folder of figures
    return folder, page_of(folder, folder.parent / "page.html")


def test_the_page_stands_alone(made):
    _folder, page = made
    assert len(page.text.encode()) < 7e6
    for tag, attributes in page.tags:
        assert not {"src", "action", "formaction", "srcset"} & set(attributes), tag
        assert tag not in ("link", "iframe", "object", "embed", "base", "img")
        assert (attributes.get("href") or "#").startswith("#")
        assert not [name for name in attributes if name.startswith("on")], tag
    style = page.text[page.text.index("<style>") : page.text.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


def test_only_its_own_scripts_may_run(made):
    (policy,) = [
        a["content"]
        for a in made[1].all("meta")
        if a.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none'; script-src ")
    scripts = [text for attributes, text in made[1].scripts if "type" not in attributes]
    hashes = {
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
        for text in scripts
    }
    assert len(hashes) == 2
    assert hashes == set(policy.split("script-src ")[1].split(";")[0].split())


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
            assert "label" in names[number - 1 : number], attributes
        if "role" in attributes:
            assert attributes["aria-label"]
    plots = {
        attributes["id"]
        for _, attributes in page.tags
        if attributes.get("class") == "plot"
    }
    assert {
        "plot-wave",
        "plot-spectrum",
        "plot-envelope",
        "plot-spectrogram",
        "plot-parameters",
        "plot-indicators",
    } <= plots


def test_every_option_has_its_data(made):
    """Each record, channel, parameter and indicator of the drop-downs is in the data of the
    page."""
    page, data = made[1], made[1].data
    values = [attributes.get("value") for attributes in page.all("option")]
    assert set(map(str, range(len(data["examples"])))) <= set(values)
    assert set(data["drawn"]["columns"]) <= set(values)
    assert all(
        len(one["views"]) == len(data["channels"]) == 2 for one in data["examples"]
    )
    assert {"wave", "spectrum", "envelope", "spectrogram"} == set(
        data["examples"][0]["views"][0]
    )
    for table in (data["drawn"], data["measured"]):
        assert len(base64.b64decode(table["class"])) == table["rows"] == 36
    column = np.frombuffer(
        base64.b64decode(data["drawn"]["columns"]["params/crack_depth_mm"]), dtype="<f4"
    )
    with open_dataset(made[0]) as source:
        np.testing.assert_allclose(
            column,
            source.column("params/crack_depth_mm"),
            rtol=1e-6,
            atol=0,
            equal_nan=True,
        )


def test_the_signals_are_those_of_the_records(made):
    data = made[1].data
    with open_dataset(made[0]) as source:
        ids = source.column("record_id").tolist()
        for one in data["examples"]:
            signal = source.signals(ids.index(one["record"]))[1].astype(float)
            packed = one["views"][1]["wave"]
            shown = (
                np.frombuffer(base64.b64decode(packed["n"]), dtype="<i2")
                * packed["scale"]
            )
            np.testing.assert_allclose(
                shown, signal, rtol=0, atol=np.abs(signal).max() / 32000
            )
            packed = one["views"][1]["spectrum"]
            frequency, amplitude = amplitude_spectrum(signal, source.sampling_rate)
            amplitude = amplitude[frequency <= 400.0]  # the usable band
            np.testing.assert_allclose(
                unpack(packed), amplitude, rtol=10 ** (0.55 * STEP_DB / 20) - 1, atol=0
            )
            assert packed["start"] == 0.0
            assert packed["step"] == pytest.approx(frequency[1])


def test_of_many_bins_the_largest_is_kept():
    from gensig.report.examples import _lines

    amplitude = np.full(1001, 1e-3)
    amplitude[347] = 5.0
    packed = _lines(np.arange(1001) * 0.5, amplitude, 500.0, 100)
    found = unpack(packed)
    assert found.max() == pytest.approx(5.0)
    at = packed["start"] + packed["step"] * found.argmax()
    assert abs(at - 347 * 0.5) <= packed["step"] / 2


def test_a_silent_signal_is_packed():
    assert not unpack(pack_amplitude(np.zeros(5))).any()
    assert pack_signal(np.zeros(5))["scale"] == 0.0


def test_text_of_the_files_is_no_markup(tmp_path):
    attributes = {
        **ATTRIBUTES,
        "channel_names": [HOSTILE, "wheel_y"],
        "channel_units": ["m/s^2", "<s>rad</s>"],
    }
    folder = build(tmp_path / "a<script>alert(1)<", make_plan(), attributes=attributes)
    page = page_of(folder, tmp_path / "page.html")
    assert len(page.scripts) == 3
    assert not page.all("img")
    assert not page.all("s")
    assert page.data["channels"][0]["name"] == HOSTILE
    assert any(HOSTILE in words for words in page.words)


def test_the_code_on_the_page_runs(made, monkeypatch):
    folder, page = made
    (code,) = re.findall(r"<code>(import gensig.*?)</code>", page.text, flags=re.DOTALL)
    code = "".join(Page(code).words).replace("PATH/TO/THIS/FOLDER", str(folder))
    names = {}
    exec(compile(code, "page", "exec"), names)
    assert len(names["mine"]) == 12
    assert names["signal"].shape == (2, 200)


def test_sound_records_of_the_same_machine_stand_beside(made):
    with open_dataset(made[0]) as data:
        chosen = choose(data, None)
        assert {
            name: len(records) for name, records in chosen.records.items()
        } == dict.fromkeys(data.class_names, 3)
        unit, middle = (
            data.column("unit_id"),
            [chosen.records[name][1] for name in ("crack", "pitting")],
        )
        matched = {
            (unit[i], data.column("condition_id")[i]) for i in chosen.records["healthy"]
        }
        sound = {
            (unit[i], data.column("condition_id")[i])
            for i in np.flatnonzero(data.column("label") == 0)
        }
        assert all(
            (unit[i], data.column("condition_id")[i]) in matched
            for i in middle
            if (unit[i], data.column("condition_id")[i]) in sound
        )


def test_what_does_not_fit_is_left_out_and_said(made):
    with open_dataset(made[0]) as data:
        chosen = choose(data, 30)
        assert chosen.n_signals <= 140
        assert "instead of 30 records a class" in chosen.remark
        data.channel_names = [f"c{i}" for i in range(40)]
        chosen = choose(data, None)
        assert chosen.n_signals <= 48
        assert "of 40 channels" in chosen.remark


def test_few_of_many_records_are_of_all_classes(made):
    """Classes are dealt in turn, so that every k-th record could be of one class alone."""
    with open_dataset(made[0]) as data:
        some = some_records(data, 12)
        assert np.bincount(data.column("label")[some]).tolist() == [4, 4, 4]


def test_frequencies_of_a_geared_engine():
    """A shaft that is none of the gears' is a reference of its own; a gear that turns with the
    crank is not."""
    rotation = Rotation(
        mesh=np.array([100.0, np.nan]),
        drive=np.array([5.0, np.nan]),
        n_teeth={"pinion": 10, "wheel": 40},
        gear=np.array(["wheel", ""]),
    )
    assert rotation.of(0) == {"mesh": 100.0, "drive": 5.0, "pinion": 10.0, "wheel": 2.5}
    assert set(rotation.of(1).values()) == {None}
    assert [name for name, _ in rotation.references] == [
        "pinion",
        "wheel",
        "drive",
        "mesh",
    ]
    assert rotation.fault_gear(0) == "wheel"
    same = Rotation(
        mesh=rotation.mesh,
        drive=np.array([10.0, np.nan]),
        n_teeth=rotation.n_teeth,
        gear=rotation.gear,
    )
    assert [name for name, _ in same.references] == ["pinion", "wheel", "mesh"]


def test_the_page_in_the_folder_leaves_the_set_whole(tmp_path, capsys):
    folder = build(tmp_path / "set", make_plan(), failed=4)
    assert main(["report", str(folder), "--records", "1"]) == 0
    assert "3 records shown, 35 measured" in capsys.readouterr().out
    assert not verify_folder(folder).problems
    assert main(["report", str(folder)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(folder.glob(".*report*"))


def _shorten(folder):
    shard = folder / "shards" / "shard-00001.h5"
    shard.write_bytes(shard.read_bytes()[:3000])


DAMAGE = {
    "no folder": (
        lambda folder: folder.rename(folder.with_name("gone")),
        "manifest.json",
    ),
    "a shard cut short": (_shorten, "shard-00001.h5"),
    "a split gone": (
        lambda folder: (folder / "splits" / "by_unit.csv").unlink(),
        "by_unit.csv",
    ),
    "no configuration": (
        lambda folder: (folder / "config.yaml").unlink(),
        "config.yaml",
    ),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_set_is_one_clear_line(tmp_path, plan, damage):
    folder = build(tmp_path / "set", plan)
    harm, named = DAMAGE[damage]
    harm(folder)
    with pytest.raises(DatasetError, match=named) as caught:
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


def test_values_that_are_not_finite_are_refused(made, monkeypatch):
    read = Dataset.signals
    monkeypatch.setattr(
        Dataset,
        "signals",
        lambda *args, **more: read(*args, **more) * np.float32(np.nan),
    )
    with pytest.raises(DatasetError, match="not finite"):
        write_report(made[0], made[0].parent / "other.html")


def test_it_opens_on_a_healthy_record(made):
    page = made[1]
    (number,) = [
        int(a["value"])
        for a in page.all("option")
        if "selected" in a and a["value"].isdigit()
    ][:1]
    assert page.data["examples"][number]["class"] == "healthy"


def test_a_fault_of_all_teeth_has_no_frequency_of_its_own(made):
    with open_dataset(made[0]) as data:
        before = read_rotation(data)
        faulty = np.flatnonzero(data.column("label") > 0)
        assert before.fault_gear(faulty[0]) == "pinion"
        data.column = lambda name, of=data.column: (
            np.full_like(of(name), -1) if name == "fault_tooth" else of(name)
        )
        assert read_rotation(data).fault_gear(faulty[0]) == ""


def test_velocity_of_a_tone_is_its_acceleration_over_its_frequency():
    time = np.arange(51200) / 51200.0
    tones = np.stack(
        [3.0 * np.sin(2 * np.pi * f * time + 0.3) for f in (100.25, 950.5, 5.0, 1500.0)]
    )
    velocity = velocity_rms(tones, 51200.0)
    expected = [3.0 / np.sqrt(2.0) / (2 * np.pi * f) for f in (100.25, 950.5)]
    np.testing.assert_allclose(velocity[:2], expected, rtol=2e-3)
    assert velocity[2:].max() < 0.02 * 3.0 / (
        2 * np.pi * 10.0
    )  # outside of 10 to 1000 Hz
    faded = 40.0 * np.cos(
        2 * np.pi * 3000.7 * time
    )  # neither end of it is 0: nothing of it leaks below 1 kHz
    assert velocity_rms(faded[None], 51200.0)[0] < 1e-6


def test_levels_are_stated_in_g_and_mm_s_and_loud_ones_are_named(made):
    with open_dataset(made[0]) as data:
        measured = Measured(
            records=np.arange(2),
            values={"rms": np.array([[97.0, 1.0], [98.1665, 1.0]])},
            further={"velocity_rms": np.array([[2e-3, 1.0], [4e-3, 1.0]])},
        )
        data.column = lambda name, of=data.column: (
            np.array(["healthy", "crack"]) if name == "label_name" else of(name)
        )
        units = ["m/s^2", "rad/s"]
        table = level_table(data, measured, ["case", "shaft"], units)
        assert table is not None
        assert list(map(list, table.rows)) == [
            ["healthy", "case", "97", "9.89", "2"],
            ["crack", "case", "98.2", "10", "4"],
        ]
        (line,) = loudness(data, measured, ["case", "shaft"], units)
        assert line.startswith("Louder than most published housings: crack. Above 10 g")
        measured.further["velocity_rms"][0, 0] = 12e-3
        assert (
            "housings: healthy, crack."
            in loudness(data, measured, ["case", "shaft"], units)[0]
        )
        assert (
            level_table(data, measured, ["case", "shaft"], ["rad/s", "rad/s"]) is None
        )
