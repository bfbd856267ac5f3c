"""The page compares within a condition: records shown, healthy signals, averaged turns, sound."""

import base64
import io
from html.parser import HTMLParser

import numpy as np
import pytest
from dataset_samples import build, forge, setting, whole_conditions
from numpy.testing import assert_allclose
from scipy.io import wavfile

from gensig.dataset.reader import open_dataset
from gensig.report.conditions import Shown, choose, healthy_beside
from gensig.report.document import report_text
from gensig.report.examples import read_signals
from gensig.report.rotation_frequencies import read_rotation
from gensig.report.severity_slider import find_sweeps, sweep_content
from gensig.report.signal_section import view_label
from gensig.report.signal_views import opening_view, signal_views
from gensig.report.sound import LOUDEST, SOUND_RATE
from gensig.report.turns import Turn, aligned, averaged_turn, conspicuity, turned
from gensig.signals.averaging import time_synchronous_average

SEVERITY = np.where(np.arange(12) % 3 == 1, 0.9 - 0.05 * np.arange(12), 0.25)
SIZE = "params/fault.crack_depth_mm"
WITH_SIZE = {"params": ["crack_depth_mm", "fault.crack_depth_mm"]}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Four conditions, each with a record of every class; severities of cracks differ."""
    columns = {
        "severity": np.where(np.arange(12) % 3 == 0, 0.0, SEVERITY),
        SIZE: np.where(np.arange(12) % 3 == 1, 4.0 * SEVERITY, np.nan),
    }
    plan = whole_conditions(**columns)
    return build(tmp_path_factory.mktemp("whole") / "set", plan, **WITH_SIZE)


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    """Faults only, each with its healthy twin; every record at a condition of its own."""
    label = np.array([1, 2] * 6)
    columns = {
        "label": label,
        "label_name": np.array(["", "crack", "pitting"])[label],
        "condition_id": np.array([f"c{index}" for index in range(12)]),
        "severity": SEVERITY,
        SIZE: np.where(label == 1, 4.0 * SEVERITY, np.nan),
    }
    plan = whole_conditions(**columns)
    folder = tmp_path_factory.mktemp("twins") / "set"
    return build(folder, plan, twin=True, **WITH_SIZE)


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    """Twelve records of one condition, of three classes, whose severities differ."""
    severity = np.where(np.arange(12) % 3 == 0, 0.0, 0.05 * np.arange(12))
    columns = {"severity": severity, "condition_id": np.full(12, "c")}
    plan = whole_conditions(unit_id=np.full(12, "u"), **columns)
    return build(tmp_path_factory.mktemp("single") / "set", plan)


def views_of(folder, per_class=None):
    with open_dataset(folder) as data:
        return signal_views(data, choose(data, per_class), read_rotation(data))


class Options(HTMLParser):
    """Values of a page's drop-downs by name, and the chosen ones."""

    def __init__(self, text):
        super().__init__()
        self.values, self.chosen, self.name = {}, {}, ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag == "select":
            self.name = given["name"]
        if tag == "option":
            self.values.setdefault(self.name, []).append(given["value"])
            if "selected" in given:
                self.chosen[self.name] = given["value"]


def test_conditions_are_shown_whole(whole):
    with open_dataset(whole) as data:
        chosen = choose(data, None)
        labels, conditions = data.column("label_name"), data.column("condition_id")
        assert len(chosen.conditions) == 3
        for condition in chosen.conditions:
            numbers = [shown.index for shown in condition.shown]
            assert set(conditions[numbers]) == {condition.name}
            assert labels[numbers].tolist() == ["healthy", "crack", "pitting"]


def test_one_condition_is_spread_over_the_severity(single):
    """Of each class the least, middle and greatest."""
    with open_dataset(single) as data:
        (condition,) = choose(data, 3).conditions
    cracks = [shown.index for shown in condition.shown if shown.index % 3 == 1]
    assert [cracks[0], cracks[-1]] == [1, 10]
    assert len(cracks) == 3


@pytest.mark.parametrize("made", ["whole", "twins"])
def test_no_comparison_crosses_conditions(made, request):
    views = views_of(request.getfixturevalue(made))
    compared = 0
    for number, view in enumerate(views):
        assert number not in view["compare"]
        for other in view["compare"]:
            compared += 1
            assert views[other]["condition"] == view["condition"]
            assert views[other]["unit"] == view["unit"]
        if view["class"] in ("crack", "pitting"):
            assert view["healthy"] in view["compare"]
    assert compared >= len(views)


def test_the_page_opens_on_a_fault_over_its_healthy_record(whole):
    with open_dataset(whole) as data:
        options = Options(report_text(data, None)[0])
    views = views_of(whole)
    record = views[int(options.chosen["record"])]
    other = views[int(options.chosen["other"])]
    assert record["class"] in ("crack", "pitting")
    assert other["class"] == "healthy"
    assert other["condition"] == record["condition"]
    assert set(options.values["other"]) == {"", *map(str, record["compare"])}


def test_it_opens_on_the_most_conspicuous_class_at_middle_severity():
    turns = {"pinion": {"n_turns": 9}}
    rows = [("healthy", 0.0, None), ("crack", 0.1, 0.2), ("crack", 0.9, 0.3)]
    rows += [("broken", 0.3, 0.9), ("broken", 0.8, 0.2), ("broken", 0.5, 1.0)]
    views = [
        {
            "class": name,
            "severity": severity,
            "conspicuity": value,
            "healthy": 0,
            "turned": "pinion",
            "turns": turns,
        }
        for name, severity, value in rows
    ]
    assert opening_view(views) == 5
    for view in views[3:]:
        view["turns"] = {"pinion": {"n_turns": 1}}  # too few to rely on
    assert opening_view(views) == 2


def test_the_healthy_signal_is_that_of_the_condition_then_the_twin(whole, twins):
    with open_dataset(whole) as data:
        assert healthy_beside(data, 0) is None
        beside = healthy_beside(data, 7)
        assert (beside.kind, beside.shown) == ("own", Shown(index=6))
    with open_dataset(twins) as data:
        beside = healthy_beside(data, 7)
        assert (beside.kind, beside.shown) == ("twin", Shown(index=7, is_twin=True))


@pytest.mark.parametrize(("speed", "kind"), [(1010.0, "near"), (1690.0, None)])
def test_a_healthy_record_far_in_speed_stands_beside_nothing(tmp_path, speed, kind):
    """The only healthy record of the unit runs at 1005 r/min, in another condition."""
    label = np.array([0, 1, 1])
    columns = {
        "label": label,
        "label_name": np.array(["healthy", "crack"])[label],
        "condition_id": np.array(["c0", "c1", "c2"]),
        "unit_id": np.full(3, "u"),
    }
    folder = build(tmp_path / "set", whole_conditions(n_records=3, **columns))
    speeds = np.array([1005.0, speed, 1690.0])
    forge(folder, 0, setting("speed_rpm", slice(None), speeds))
    with open_dataset(folder) as data:
        beside = healthy_beside(data, 1)
        assert getattr(beside, "kind", None) == kind
        words = [
            view["beside"]
            for view in signal_views(data, choose(data, None), read_rotation(data))
        ]
    assert any("of another condition" in text for text in words) is (kind == "near")


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["n"]), "<i2") * packed["scale"]


def test_an_averaged_turn_is_that_of_the_signals(whole):
    """It begins at tooth 0: the average begins at tooth 1.5 of 23, as the columns say."""
    with open_dataset(whole) as data:
        rotation, shown = read_rotation(data), Shown(index=4)
        signals = read_signals(data, shown, data.channel_names)
        turn = averaged_turn(data, rotation, shown, signals, "pinion")
    average = time_synchronous_average(signals, 1000.0, 690.0 / 23)
    n_points = turn.values.shape[-1]
    spectrum = np.fft.rfft(average) / average.shape[-1]
    order = np.arange(spectrum.shape[-1] - 1)
    position = np.arange(n_points) / n_points - 1.5 / 23
    waves = np.exp(2j * np.pi * np.outer(order, position))
    twice = np.where(order > 0, 2.0, 1.0)
    expected = ((spectrum[:, :-1] * twice) @ waves).real
    assert_allclose(turn.values, expected, rtol=0, atol=1e-9)
    assert turn.n_turns == 6
    assert turn.from_tooth_0


def test_turns_begun_at_other_teeth_are_the_same_turn():
    angle = 2 * np.pi * np.arange(240) / 240

    def shape(start):
        return np.cos(3 * (angle + start)) + 0.4 * np.sin(20 * (angle + start) + 1.0)

    for start in (0.0, 0.3, 0.77):
        begun = shape(2 * np.pi * start)
        moved = turned(begun, start, 240)
        assert_allclose(moved, shape(0.0), rtol=0, atol=1e-12)
        back = turned(turned(begun, start, 480), 0.0, 240)
        assert_allclose(back, shape(0.0), rtol=0, atol=1e-12)
    assert np.abs(turned(shape(1.0), 0.0, 240) - shape(0.0)).max() > 0.5


@pytest.mark.parametrize(("from_tooth_0", "teeth"), [(True, 0.03), (False, 7.2)])
def test_turns_of_a_condition_lie_over_each_other(from_tooth_0, teeth):
    """A lag of a shaft is taken out; more only where the tooth is not known."""
    rng = np.random.default_rng(5)
    values = turned(rng.standard_normal((2, 920)), 0.0, 920)
    moved = turned(values, teeth / 23, 920)
    first, second = (
        Turn(values=given, n_turns=9, from_tooth_0=from_tooth_0)
        for given in (values, moved)
    )
    result = aligned([None, first, second], 23)
    assert result[0] is None
    assert conspicuity(moved, values) > 0.3
    assert conspicuity(result[2].values, result[1].values) < 0.05
    if from_tooth_0:
        far = Turn(values=turned(values, 1 / 23, 920), n_turns=9, from_tooth_0=True)
        result = aligned([first, far], 23)
        assert conspicuity(result[1].values, values) > 0.3


def test_conspicuity_is_the_share_of_the_change():
    healthy = np.array([3.0, -3.0, 3.0, -3.0])
    change = np.array([1.5, 1.5, -1.5, -1.5])
    assert conspicuity(healthy + change, healthy) == pytest.approx(0.5)
    assert conspicuity(healthy + 7.0, healthy) == pytest.approx(0.0, abs=1e-12)


def test_sound_is_a_wav_file_on_one_scale_within_a_condition(whole):
    views = views_of(whole)
    head = "data:audio/wav;base64,"
    peaks = {}
    with open_dataset(whole) as data:
        ids = data.column("record_id").tolist()
        for view in views:
            assert view["sound"].startswith(head)
            file = io.BytesIO(base64.b64decode(view["sound"].removeprefix(head)))
            rate, counts = wavfile.read(file)
            assert rate == SOUND_RATE == 16000
            assert counts.dtype == np.int16
            assert counts.shape == (3200,)  # 0.2 s
            signal = data.signals(ids.index(view["record"]))[0].astype(float)
            ratio = np.std(counts.astype(float)) / np.std(signal)
            heard = np.abs(counts.astype(int)).max()
            peaks.setdefault(view["set"], []).append((heard, ratio))
    for of_condition in peaks.values():
        heard, ratios = np.array(of_condition).T
        assert heard.max() == pytest.approx(LOUDEST * 32767, abs=1)
        assert_allclose(ratios, ratios[0], rtol=0.1)


def test_a_sweep_steps_through_the_severity_over_twins(twins):
    with open_dataset(twins) as data:
        rotation = read_rotation(data)
        sweeps = {sweep.name: sweep for sweep in find_sweeps(data, rotation)}
        sweep = sweeps["crack"]
        content = sweep_content(data, rotation, sweep, "pinion_y")
        severity = data.column("severity")[sweep.records]
        index = int(sweep.records[1])
        signal = data.signals(index)[0].astype(float)
    steps = content["steps"]
    assert (np.diff(severity) > 0).all()
    assert [step["severity"] for step in steps] == severity.tolist()
    assert f"crack depth {4 * severity[1]:.3g} mm, " in steps[1]["label"]
    wave = unpacked(steps[1]["wave"])
    assert_allclose(wave, 0.75 * signal, rtol=0, atol=np.abs(wave).max() / 32000)
    # the twin is a quarter of the record: the difference is three times the twin
    assert_allclose([step["change"] for step in steps], 3.0, rtol=1e-6)


def test_a_set_without_twins_has_a_slider_where_a_condition_holds_several_sizes(
    whole, single
):
    with open_dataset(whole) as data:
        assert find_sweeps(data, read_rotation(data)) == []
    with open_dataset(single) as data:
        sweeps = find_sweeps(data, read_rotation(data))
        text = report_text(data, None)[0]
    assert {sweep.name: len(sweep.records) for sweep in sweeps} == {
        "crack": 4,
        "pitting": 4,
    }
    assert '<input type="range" name="step" min="0" max="3"' in text
    assert 'id="plot-step_wave"' not in text  # no twin to subtract


def test_a_healthy_record_of_another_condition_is_named_as_such(tmp_path):
    label = np.array([0, 1])
    columns = {
        "label": label,
        "label_name": np.array(["healthy", "crack"]),
        "condition_id": np.array(["c0", "c1"]),
        "unit_id": np.full(2, "u"),
    }
    folder = build(tmp_path / "set", whole_conditions(n_records=2, **columns))
    views = views_of(folder)
    (crack,) = [view for view in views if view["class"] == "crack"]
    beside = views[crack["healthy"]]
    assert (beside["of"], beside["condition"]) == ("c1", "c0")
    assert view_label(beside).endswith(", of another condition")
    assert not view_label(crack).endswith(", of another condition")
