"""Order tracking: recordings of varying speed give the answers of steady ones."""

import json

import numpy as np
import pytest
from fake_dataset import N_TEETH
from numpy.testing import assert_allclose
from scipy.signal import hilbert, resample
from small_studies import command, two_channels

from diagnose.data.tracking import Tracked, at_constant_speed, track_by_tacho
from diagnose.training.store import load_model
from gensig.signals.recording import Recording

RATE = 12800
TEETH = ["--teeth", *N_TEETH.values()]
TACHO = ["--tacho", "pulses"]


@pytest.fixture
def predict(two_channel_model, tmp_path, capsys):
    """Function that returns status and answer of the command for a signal, maybe with pulses."""

    def answer(signal, *words, pulse=None, form="--json"):
        columns = {"channel_0": signal[0], "channel_1": signal[1]}
        if pulse is not None:
            columns["pulses"] = 5.0 * pulse
        file = tmp_path / "r.csv"
        table, head = np.column_stack(list(columns.values())), ",".join(columns)
        np.savetxt(file, table, "%.7g", ",", header=head, comments="")
        given = ["--model", two_channel_model, file, "--sampling-rate", RATE, *words]
        status, text, error = command(capsys, "predict", *given, form)
        if form == "--json" and text:
            return status, json.loads(text)
        return status, text or error

    return answer


def wandering(record, depth=0.0, *, duration, speed_rpm=None, n_swings=1.0):
    """Record at a speed that swings by a share, pulses of a tachometer, one a turn, and its speed.

    Time is stretched as a whole, so that angle alone undoes it.
    """
    data = two_channels(duration=duration)
    signal = data.signals(record)
    speed = data.column("speed_rpm")[record]
    time = np.arange(signal.shape[1]) / RATE
    swing = 2 * np.pi * n_swings / duration
    turned = time + depth / swing * (1 - np.cos(swing * time))
    turned = turned[turned < time[-1]]
    fine = resample(signal, 16 * signal.shape[1], axis=1)
    sample = np.arange(fine.shape[1]) / RATE
    stretched = np.stack([np.interp(turned * 16, sample, row) for row in fine])
    phase = turned * (speed_rpm or speed) / 60 - 0.3
    return stretched, (np.mod(phase, 1.0) < 0.1).astype(float), speed


def likelihood(result):
    return np.array(list(result["probabilities"].values()))


@pytest.fixture(scope="module")
def run_up():
    """Turns of a shaft from slow to fast, and the pulses of a tachometer."""
    turns = np.cumsum(np.linspace(15.0, 45.0, 4 * RATE)) / RATE
    return turns, (np.mod(turns, 1.0) < 0.2).astype(float)


def tracked_by_tacho(signal, pulse):
    sensors = ("a", "b")[: len(signal)]
    recording = Recording(
        sensors=sensors, acceleration=signal, sampling_rate=float(RATE)
    )
    tracked = track_by_tacho(recording, pulse, "pulses", pulses_per_turn=1)
    return tracked, at_constant_speed(tracked, RATE, 1800.0).signal


def test_a_tachometer_undoes_a_run_from_slow_to_fast(run_up):
    """Exactly, for a signal that is a function of angle alone."""
    turns, pulse = run_up
    order = 9.0
    angle = 2 * np.pi * order * turns
    signal = np.stack([np.sin(angle), np.cos(angle)])
    tracked, played = tracked_by_tacho(signal, pulse)
    assert tracked.speed_rpm == pytest.approx(1800.0, rel=0.02)
    assert tracked.speed_range_rpm == pytest.approx((900.0, 2700.0), rel=0.06)
    power = np.abs(np.fft.rfft(played[0] * np.hanning(played.shape[1]))) ** 2
    line = order * 30.0 * played.shape[1] / RATE
    assert abs(power.argmax() - line) <= 1
    near = np.abs(np.arange(power.size) - line) < 6
    assert np.sum(power[near]) > 0.995 * np.sum(power)
    # without tracking the run smears the line
    as_made = np.abs(np.fft.rfft(signal[0] * np.hanning(signal.shape[1]))) ** 2
    assert np.sum(np.sort(as_made)[-12:]) < 0.2 * np.sum(as_made)


def test_nothing_is_aliased_while_the_run_is_slow(run_up):
    """A tone above the band of the result, while the shaft is slow, is filtered out."""
    turns, pulse = run_up
    time = np.arange(turns.size) / RATE
    high = np.sin(2 * np.pi * 5500.0 * time) * (turns < 12.0)
    _, played = tracked_by_tacho(high[None], pulse)
    inner = played[0, 500 : round(10.0 / 30.0 * RATE)]
    assert np.sqrt(np.mean(inner**2)) < 1e-2


@pytest.mark.parametrize("speed_rpm", [1800.0, 1234.3, 2222.2])
def test_the_speed_of_the_result_is_exact_to_a_hundredth_of_a_tooth(speed_rpm):
    """Rates are ratios of whole numbers; teeth would drift if the wanted speed were believed."""
    per_turn, n_turns, teeth = 2488, 40, 23
    angle = 2 * np.pi * np.arange(n_turns * per_turn) / per_turn
    tracked = Tracked(
        by="mesh",
        signal=np.sin(teeth * angle)[None],
        samples_per_turn=per_turn,
        speed_rpm=speed_rpm,
        speed_range_rpm=(speed_rpm, speed_rpm),
    )
    played = at_constant_speed(tracked, 51200.0, speed_rpm)
    time = np.arange(played.signal.shape[-1]) / 51200.0
    passages = teeth * played.speed_rpm / 60.0 * time
    inner = slice(2000, -2000)
    phase = np.unwrap(np.angle(hilbert(played.signal[0]))) / (2 * np.pi) + 0.25
    assert np.abs(phase - passages)[inner].max() < 0.01
    assert played.speed_rpm == pytest.approx(speed_rpm, rel=5e-4)


@pytest.mark.parametrize(("record", "depth"), [(80, 0.0), (80, 0.02), (83, 0.02)])
@pytest.mark.parametrize("how", ["tacho", "mesh"])
def test_a_speed_that_may_vary_is_replaced_by_its_mean(how, record, depth, predict):
    moved, pulse, speed = wandering(record, depth, duration=2.0)
    words = {"tacho": TACHO, "mesh": [*TEETH, "--speed-rpm", f"{speed:.0f}"]}[how]
    pulse = pulse if how == "tacho" else None
    _, tracked = predict(moved, *words, "--to-speed", f"{speed:.6g}", pulse=pulse)
    _, plain = predict(wandering(record, duration=2.0)[0])
    facts = tracked["order_tracking"]
    assert facts["by"] == how
    assert facts["played_at_rpm"] == pytest.approx(speed, rel=1e-5)
    low, high = facts["speed_range_rpm"]
    assert high / low == pytest.approx(1 + 2 * depth, abs=0.015)
    assert_allclose(facts["speed_rpm"], speed, rtol=2e-3)
    assert_allclose(likelihood(tracked), likelihood(plain), rtol=0, atol=0.12)
    assert tracked["out_of_distribution"] == plain["out_of_distribution"]


def test_a_speed_outside_the_training_is_reported_at_any_played_speed(
    two_channel_model, predict
):
    low, high = load_model(two_channel_model)[1].speed_rpm_range
    fast, pulse, _ = wandering(80, duration=1.0, speed_rpm=2.0 * high)
    status, error = predict(fast, *TACHO, "--to-speed", f"{high - 1:.4f}", pulse=pulse)
    assert status == 2  # at half the speed it holds half the band
    assert "played at" in error
    assert f"the model was trained at {RATE}" in error
    slow, pulse, _ = wandering(80, duration=1.0, speed_rpm=0.5 * low)
    status, result = predict(slow, *TACHO, "--to-speed", f"{low + 1:.4f}", pulse=pulse)
    assert status == 3
    assert any("is outside the" in reason for reason in result["reasons"])
    assert result["order_tracking"]["played_at_rpm"] == pytest.approx(low + 1, rel=1e-4)


def test_other_teeth_are_reported(predict):
    signal = two_channels().signals(80)
    status, result = predict(signal, *TEETH)
    assert (status, result["reasons"]) == (0, [])
    assert result["order_tracking"] is None  # that needs a speed
    status, result = predict(signal, "--teeth", "23", "57")
    reason = "the gears have 23/57 teeth, those of the training 23/84"
    assert (status, result["reasons"]) == (3, [reason])
    assert result["trained_n_teeth"] == [23, 84]
    assert predict(signal, "--teeth", "84", "23")[0] == 3


def test_as_recorded_leaves_the_time_axis_alone(predict):
    signal, pulse, _ = wandering(80, duration=0.5)
    _, plain = predict(signal)
    _, result = predict(signal, *TACHO, "--as-recorded", pulse=pulse)
    assert likelihood(result).tolist() == likelihood(plain).tolist()


PULSES = [
    (["--tacho", "tach"], "no channel tach; it has channel_0, channel_1, pulses"),
    ([*TACHO, "--pulses-per-turn", "60"], "span no two turns"),
    ([*TACHO, "--pulses-per-turn", "0"], "--pulses-per-turn 0 must be at least 1"),
    ([*TACHO, "--pulses-per-turn", "2", "--speed-rpm", "1200"], "--speed-rpm says"),
    (
        ["--tacho", "channel_0", "--channels", "channel_1", "pulses"],
        "the time between pulses jumps",
    ),
    (["--to-speed", "1500"], "--to-speed needs order tracking"),
    ([*TACHO, "--to-speed", "9000"], "--to-speed 9000 must lie in the"),
    (["--teeth", "2", "84"], "--teeth 2 84: a gear has 4 to 1000 teeth"),
]
NOISE = [
    ([*TEETH, "--speed-rpm", "1500"], "sign of the mesh"),
    ([*TEETH, "--speed-rpm", "15000"], "lies above 5000 Hz"),
]
SHORT = [
    (
        [*TEETH, "--speed-rpm", "1200"],
        "turns of the slower gear, at least 4 are needed",
    ),
    ([*TEETH, "--speed-rpm", "24.46"], "is 24.46 r/min in Hz? Then say 1467.6"),
]


def test_refusals_are_one_line(predict):
    signal, pulse, _ = wandering(80, duration=1.0)
    lost = pulse.copy()
    first = np.flatnonzero(np.diff(pulse) > 0)[4]
    lost[first : first + RATE // 40] = 0.0
    noise = np.random.default_rng(0).standard_normal((2, 2 * RATE))
    for recording, pulses, table in (
        (signal, pulse, PULSES),
        (signal, lost, [(TACHO, "a pulse too few or too many")]),
        (noise, None, NOISE),
        (signal[:, : RATE // 4], None, SHORT),
    ):
        for words, message in table:
            status, error = predict(recording, *words, pulse=pulses)
            assert status == 2, words
            assert message in error
            assert len(error.strip().splitlines()) == 1


def test_the_line_of_an_answer_names_the_tracking(predict):
    signal, pulse, _ = wandering(80, 0.01, duration=1.0, speed_rpm=1234.0)
    _, text = predict(signal, "--tacho", pulse=pulse, form="pulses")
    (line,) = text.strip().splitlines()
    assert "(speed by tacho, 12" in line
    assert "played at 12" in line
