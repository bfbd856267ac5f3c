"""Fingerprints: a recording is known again whatever its form, and others of its machine are not."""

from dataclasses import replace

import numpy as np
import pytest
from implant_samples import CARRIER_RATE, carrier
from refusals import refused
from scipy.signal import butter, resample_poly, sosfiltfilt

from gensig.implants import fingerprints
from gensig.implants.fingerprints import (
    MOST_PIECES,
    PIECE,
    RATE,
    fingerprints_content,
    fingerprints_from,
    fingerprints_of,
    known_alike,
    known_in,
)

SECONDS = 8.0
NOISE = np.random.default_rng(1)


def noisy(x, db):
    return x + x.std() * 10 ** (-db / 20) * NOISE.standard_normal(x.shape)


LOW = butter(4, 1000.0, fs=CARRIER_RATE, output="sos")
# name -> samples, their rate, and the second of the recording that the first sample is at
ALTERED = {
    "half": lambda x: (x[:, : x.shape[1] // 2], CARRIER_RATE, 0.0),
    "a fifth": lambda x: (x[:, : x.shape[1] // 5], CARRIER_RATE, 0.0),
    "middle": lambda x: (x[:, 24001:40001], CARRIER_RATE, 24001 / CARRIER_RATE),
    "in g": lambda x: (-x / 9.80665 + 1.0, CARRIER_RATE, 0.0),
    "slower": lambda x: (resample_poly(x, 3, 4, axis=1), 0.75 * CARRIER_RATE, 0.0),
    "faster": lambda x: (resample_poly(x, 5, 2, axis=1), 2.5 * CARRIER_RATE, 0.0),
    "float32": lambda x: (x.astype(np.float32), CARRIER_RATE, 0.0),
    "int8": lambda x: (np.round(x / np.abs(x).max() * 127), CARRIER_RATE, 0.0),
    "low-passed": lambda x: (sosfiltfilt(LOW, x, axis=1), CARRIER_RATE, 0.0),
    "noise": lambda x: (noisy(x, 30.0), CARRIER_RATE, 0.0),
}


def recording(seed, **options):
    return carrier(seed, seconds=SECONDS, **options)[0]


@pytest.fixture(scope="module")
def stored():
    """Fingerprints of two recordings of a machine, as a file holds them."""
    made = fingerprints_of({str(seed): recording(seed) for seed in range(2)})
    return fingerprints_from(fingerprints_content(made))


@pytest.mark.parametrize("name", ALTERED)
def test_a_recording_is_known_in_another_form_and_where_it_begins(stored, name):
    whole = recording(0)
    samples, rate, start = ALTERED[name](whole.acceleration)
    asked = replace(whole, acceleration=np.asarray(samples, float), sampling_rate=rate)
    found = known_in(asked, stored)
    assert {known.samples_sha256 for known in found} == {"0"}
    assert found[0].delay == pytest.approx(start, abs=1.0 / RATE)


@pytest.mark.parametrize("wander", [0.01, 0.0])
def test_other_recordings_of_the_machine_are_not(stored, wander):
    mine = stored
    if not wander:
        mine = fingerprints_of({"0": recording(0, wander=0.0)})
    for seed in range(2, 12):
        assert known_in(recording(seed, wander=wander), mine) == ()


def steady(seed):
    """A machine of constant speed with hardly any noise: all its recordings sound alike."""
    time = np.arange(round(SECONDS * CARRIER_RATE)) / CARRIER_RATE
    rng = np.random.default_rng(seed)
    orders = np.arange(80.0, 1500.0, 3.0)
    tones = np.cos(2 * np.pi * np.outer(orders, time + rng.uniform())).sum(axis=0)
    signal = tones + 1e-2 * rng.standard_normal(time.size)
    return replace(recording(0), acceleration=signal[None])


def test_recordings_that_repeat_themselves_are_no_alarm(monkeypatch):
    """Without the likeness of a recording to its other places they would be."""
    assert known_in(steady(1), fingerprints_of({"0": steady(0)})) == ()
    assert known_in(steady(0), fingerprints_of({"0": steady(0)})) != ()
    monkeypatch.setattr(fingerprints, "_elsewhere", lambda *_: 0.0)
    assert known_in(steady(1), fingerprints_of({"0": steady(0)})) != ()


def test_two_fingerprints_are_compared_as_a_recording_is(stored):
    whole = recording(1)
    part = replace(whole, acceleration=-whole.acceleration[:, 9001:])
    (found, *_) = known_alike(fingerprints_of({"part": part}), stored)
    assert found.samples_sha256 == "1"
    assert found.delay == pytest.approx(9001 / CARRIER_RATE, abs=1.0 / RATE)
    assert known_alike(fingerprints_of({"other": recording(7)}), stored) == ()


def test_their_size_is_bounded_and_they_stay_spread():
    whole = recording(0)
    (few,) = fingerprints_of({"0": whole}, most=5)
    assert len(few.first) == len(few.packed) * 8 // PIECE == 5
    assert few.first[-1] > 0.7 * SECONDS * RATE
    assert known_in(whole, [few])
    (of_a_moment,) = fingerprints_of(
        {"0": replace(whole, acceleration=whole.acceleration[:, :100])}
    )
    assert of_a_moment.first == ()
    assert known_in(whole, [of_a_moment]) == ()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("pieces", "AAAA"),
        ("pieces", "!"),
        ("pieces", None),
        ("first", [-1] * 16),
        ("first", None),
        ("least", 0.0),
        ("least", float("nan")),
        ("sampling_rate_hz", 0.0),
    ],
)
def test_damaged_fingerprints_are_refused(stored, key, value):
    content = fingerprints_content(stored)
    content[0][key] = value
    with refused("fingerprint", ValueError):
        fingerprints_from(content)


def test_more_pieces_than_any_set_has_are_refused(stored):
    content = fingerprints_content(stored) * (MOST_PIECES // 16)
    with refused(f"more than {MOST_PIECES} pieces", ValueError):
        fingerprints_from(content)
