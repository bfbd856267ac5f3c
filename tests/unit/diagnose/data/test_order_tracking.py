"""A recording whose speed wanders, played at one speed: the answer of the steady machine, by tachometer or by mesh."""

import json

import numpy as np
import pytest
import torch
from fake_dataset import N_TEETH, FakeDataset
from numpy.testing import assert_allclose
from scipy.signal import resample

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.tracking import at_constant_speed, track_by_tacho
from diagnose.training.store import load_model
from gensig.signals.recording import Recording

RATE = 12800
TEETH = [str(n_teeth) for n_teeth in N_TEETH.values()]
FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=5", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "shuffle_control=false", "baselines=false",
]  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def fake(duration=0.5):
    return FakeDataset(n_units=12, records_per_unit=8, duration=duration, n_channels=2)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        assert main(["train", "data=good", f"out={folder / 'out'}", *FAST]) == 0
    return str(folder / "out" / "models" / "by_unit-seed0")


def wandering(signal, speed_rpm, depth, *, n_swings=1.0):
    """The same turns at a speed that swings by a share, and the pulses of a tachometer, one a turn.

    Time is stretched as a whole, so that angle alone undoes it.
    """
    duration = signal.shape[1] / RATE
    time = np.arange(signal.shape[1]) / RATE
    swing = 2 * np.pi * n_swings / duration
    turned = time + depth / swing * (1 - np.cos(swing * time))
    turned = turned[turned < time[-1]]
    fine = resample(signal, 16 * signal.shape[1], axis=1)
    stretched = np.stack(
        [np.interp(turned * 16, np.arange(fine.shape[1]) / RATE, row) for row in fine]
    )
    pulse = (np.mod(turned * speed_rpm / 60 - 0.3, 1.0) < 0.1).astype(float)
    return stretched, pulse


def csv(path, signal, pulse=None):
    columns = {
        "channel_0": signal[0],
        "channel_1": signal[1],
        **({} if pulse is None else {"pulses": 5.0 * pulse}),
    }
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        "%.7g",
        ",",
        header=",".join(columns),
        comments="",
    )
    return [str(path), "--sampling-rate", str(RATE)]


def asked(capsys, model, words):
    capsys.readouterr()
    status = main(["predict", "--model", model, *words, "--json"])
    captured = capsys.readouterr()
    return status, json.loads(captured.out) if captured.out else captured.err


def likelihood(result):
    return np.array(list(result["probabilities"].values()))


@pytest.mark.parametrize("record", [80, 81, 82, 83])
def test_a_steady_recording_says_the_same_tracked(model, record, tmp_path, capsys):
    data = fake(duration=1.5)
    speed = data.column("speed_rpm")[record]
    steady, pulse = wandering(data.signals(record), speed, 0.0)
    words = csv(tmp_path / "r.csv", steady, pulse)
    _, plain = asked(capsys, model, [*words, "--channels", "channel_0", "channel_1"])
    _, by_tacho = asked(capsys, model, [*words, "--tacho", "pulses"])
    _, by_mesh = asked(
        capsys,
        model,
        [
            *csv(tmp_path / "m.csv", steady),
            "--speed-rpm",
            f"{speed:.0f}",
            "--teeth",
            *TEETH,
        ],
    )
    for tracked, tolerance in ((by_tacho, 2e-4), (by_mesh, 1e-3)):
        assert_allclose(tracked["order_tracking"]["speed_rpm"], speed, rtol=tolerance)
        assert_allclose(likelihood(tracked), likelihood(plain), rtol=0, atol=0.12)
        assert tracked["out_of_distribution"] == plain["out_of_distribution"]


def test_tachometer_undoes_a_run_from_slow_to_fast(tmp_path):
    """Exactly, where the signal is a function of angle alone."""
    turns = np.cumsum(np.linspace(15.0, 45.0, 4 * RATE)) / RATE
    order = 9.0
    signal = np.stack(
        [np.sin(2 * np.pi * order * turns), np.cos(2 * np.pi * order * turns)]
    )
    pulse = (np.mod(turns, 1.0) < 0.2).astype(float)
    recording = Recording(
        sensors=("a", "b"), acceleration=signal, sampling_rate=float(RATE)
    )
    tracked = track_by_tacho(recording, pulse, "pulses", pulses_per_turn=1)
    assert tracked.speed_rpm == pytest.approx(1800.0, rel=0.02)
    assert tracked.speed_range_rpm == pytest.approx((900.0, 2700.0), rel=0.06)
    played = at_constant_speed(tracked, RATE, 1800.0)
    spectrum = np.abs(np.fft.rfft(played * np.hanning(played.shape[1]), axis=1))
    line = order * 30.0 * played.shape[1] / RATE
    assert abs(spectrum[0].argmax() - line) <= 1
    near = np.abs(np.arange(spectrum.shape[1]) - line) < 6
    assert np.sum(spectrum[0][near] ** 2) > 0.995 * np.sum(spectrum[0] ** 2)
    as_made = np.abs(np.fft.rfft(signal[0] * np.hanning(signal.shape[1])))
    assert np.sum(np.sort(as_made**2)[-12:]) < 0.2 * np.sum(
        as_made**2
    )  # the run itself smears the line


def test_nothing_folds_where_the_run_is_slow():
    """A tone above what the played rate holds, while the shaft is slow, is shut out instead of folded."""
    turns = np.cumsum(np.linspace(15.0, 45.0, 4 * RATE)) / RATE
    time = np.arange(turns.size) / RATE
    pulse = (np.mod(turns, 1.0) < 0.2).astype(float)
    high = np.sin(2 * np.pi * 5500.0 * time) * (turns < 12.0)
    recording = Recording(
        sensors=("a",), acceleration=high[None], sampling_rate=float(RATE)
    )
    played = at_constant_speed(
        track_by_tacho(recording, pulse, "p", pulses_per_turn=1), RATE, 1800.0
    )
    inner = played[0, 500 : round(10.0 / 30.0 * RATE)]
    assert np.sqrt(np.mean(inner**2)) < 1e-2


@pytest.mark.parametrize("how", ["tacho", "mesh"])
def test_a_speed_that_wanders_is_played_at_its_mean(model, how, tmp_path, capsys):
    data = fake(duration=2.0)
    for record in (80, 81, 83):
        speed = data.column("speed_rpm")[record]
        moved, pulse = wandering(data.signals(record), speed, 0.02)
        steady, _ = wandering(data.signals(record), speed, 0.0)
        words = csv(tmp_path / "w.csv", moved, pulse if how == "tacho" else None)
        words += (
            ["--tacho", "pulses"]
            if how == "tacho"
            else ["--teeth", *TEETH, "--speed-rpm", f"{speed:.0f}"]
        )
        _, tracked = asked(capsys, model, [*words, "--to-speed", f"{speed:.6g}"])
        _, plain = asked(capsys, model, csv(tmp_path / "s.csv", steady))
        facts = tracked["order_tracking"]
        assert facts["by"] == how
        assert facts["played_at_rpm"] == pytest.approx(speed, rel=1e-5)
        low, high = facts["speed_range_rpm"]
        assert high / low == pytest.approx(1.04, abs=0.015)
        assert_allclose(likelihood(tracked), likelihood(plain), rtol=0, atol=0.12)


def test_a_speed_outside_the_training_is_said_whatever_it_is_played_at(
    model, tmp_path, capsys
):
    data = fake(duration=1.0)
    low, high = load_model(model)[1].speed_rpm_range
    signal, pulse = wandering(data.signals(80), 2.0 * high, 0.0)
    words = [
        *csv(tmp_path / "r.csv", signal, pulse),
        "--tacho",
        "pulses",
        "--to-speed",
        f"{high - 1:.4f}",
    ]
    status, result = asked(capsys, model, words)
    assert status == 2  # half as fast holds half the band
    assert "played at" in result
    assert f"the model was trained at {RATE}" in result
    signal, pulse = wandering(data.signals(80), 0.5 * low, 0.0)
    words = [
        *csv(tmp_path / "r.csv", signal, pulse),
        "--tacho",
        "pulses",
        "--to-speed",
        f"{low + 1:.4f}",
    ]
    status, result = asked(capsys, model, words)
    assert status == 3
    assert any("is outside the" in reason for reason in result["reasons"])
    assert result["order_tracking"]["played_at_rpm"] == pytest.approx(low + 1, rel=1e-4)


def test_other_teeth_are_said(model, tmp_path, capsys):
    data = fake()
    words = csv(tmp_path / "r.csv", data.signals(80))
    status, own = asked(capsys, model, [*words, "--teeth", *TEETH])
    assert (status, own["reasons"]) == (0, [])
    assert own["order_tracking"] is None  # a speed is needed for that
    status, other = asked(capsys, model, [*words, "--teeth", "23", "57"])
    assert status == 3
    assert other["reasons"] == [
        "the gears have 23/57 teeth, those of the training 23/84"
    ]
    assert other["trained_n_teeth"] == [23, 84]
    assert asked(capsys, model, [*words, "--teeth", "84", "23"])[0] == 3


def test_as_recorded_leaves_the_time_axis_alone(model, tmp_path, capsys):
    data = fake()
    signal, pulse = wandering(data.signals(80), data.column("speed_rpm")[80], 0.0)
    plain = asked(capsys, model, csv(tmp_path / "p.csv", signal))[1]
    words = [
        *csv(tmp_path / "r.csv", signal, pulse),
        "--tacho",
        "pulses",
        "--as-recorded",
    ]
    assert (
        likelihood(asked(capsys, model, words)[1]).tolist()
        == likelihood(plain).tolist()
    )


def test_what_cannot_be_tracked_is_refused_in_one_line(model, tmp_path, capsys):
    data = fake(duration=1.0)
    speed = data.column("speed_rpm")[80]
    signal, pulse = wandering(data.signals(80), speed, 0.0)
    words = csv(tmp_path / "r.csv", signal, pulse)
    first = np.flatnonzero(np.diff(pulse) > 0)[4]
    lost = pulse.copy()
    lost[first : first + RATE // 40] = 0.0
    noise = np.random.default_rng(0).standard_normal((2, 2 * RATE))
    noisy = csv(tmp_path / "noise.csv", noise)
    short = csv(tmp_path / "short.csv", signal[:, : RATE // 4])
    for given, message in [
        (
            [*words, "--tacho", "tach"],
            "no channel tach; it has channel_0, channel_1, pulses",
        ),
        ([*words, "--tacho", "pulses", "--pulses-per-turn", "60"], "span no two turns"),
        (
            [*words, "--tacho", "pulses", "--pulses-per-turn", "0"],
            "--pulses-per-turn 0 must be at least 1",
        ),
        (
            [
                *words,
                "--tacho",
                "pulses",
                "--pulses-per-turn",
                "2",
                "--speed-rpm",
                f"{speed:.0f}",
            ],
            "--speed-rpm says",
        ),
        (
            [*words, "--tacho", "channel_0", "--channels", "channel_1", "pulses"],
            "the time between pulses jumps",
        ),
        (
            [*csv(tmp_path / "lost.csv", signal, lost), "--tacho", "pulses"],
            "a pulse too few or too many",
        ),
        ([*words, "--to-speed", "1500"], "--to-speed needs order tracking"),
        (
            [*words, "--tacho", "pulses", "--to-speed", "9000"],
            "--to-speed 9000 must lie in the",
        ),
        ([*words, "--teeth", "2", "84"], "--teeth 2 84: a gear has 4 to 1000 teeth"),
        ([*noisy, "--teeth", *TEETH, "--speed-rpm", "1500"], "sign of the mesh"),
        (
            [*short, "--teeth", *TEETH, "--speed-rpm", "1200"],
            "turns of the slower gear, at least 4 are needed",
        ),
        (
            [*short, "--teeth", *TEETH, "--speed-rpm", "24.46"],
            "is 24.46 r/min in Hz? Then say 1467.6",
        ),
        (
            [*noisy, "--teeth", "40", "84", "--speed-rpm", "1500"],
            "sidebands look like the mesh",
        ),
        ([*noisy, "--teeth", *TEETH, "--speed-rpm", "15000"], "lies above 5000 Hz"),
    ]:
        status, text = asked(capsys, model, given)
        assert status == 2, given
        assert message in text
        assert len(text.strip().splitlines()) == 1


def test_the_line_tells_what_was_done(model, tmp_path, capsys):
    data = fake(duration=1.0)
    signal, pulse = wandering(data.signals(80), 1234.0, 0.01)
    capsys.readouterr()
    main(
        [
            "predict",
            "--model",
            model,
            *csv(tmp_path / "r.csv", signal, pulse),
            "--tacho",
            "pulses",
        ]
    )
    line = capsys.readouterr().out.strip()
    assert "(speed by tacho, 12" in line
    assert "played at 12" in line
    assert "\n" not in line
