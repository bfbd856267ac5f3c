"""Transforms: the change that is asked for, other draws for each example, repeatable."""

import pickle

import pytest
import torch
from torch.testing import assert_close

from diagnose.data import (
    AddNoise,
    ChooseChannels,
    Compose,
    DropChannels,
    Gain,
    Resample,
    Shift,
)
from diagnose.data.loading.transforms import transformed
from gensig.errors import ConfigError

ALL = [
    AddNoise((0, 20)),
    AddNoise((0, 20), color="pink"),
    Gain((-6, 6)),
    Gain((-6, 6), by_channel=True),
    Shift(400),
    Resample((0.9, 1.1)),
    DropChannels(0.5),
    ChooseChannels(2),
    Compose([Gain((-6, 6)), Shift(400)]),
]
N_SAMPLES = 2048


def seeded(seed=0):
    return torch.Generator().manual_seed(seed)


def windows(n_batch=6, n_channels=3, seed=1):
    draw = torch.randn((n_batch, n_channels, N_SAMPLES), generator=seeded(seed))
    return draw * torch.arange(1, n_channels + 1)[None, :, None]


def tone(frequency, n_samples=N_SAMPLES):
    """A tone (1, sample) of a frequency in periods a sample."""
    sample = torch.arange(n_samples, dtype=torch.float64)
    return torch.sin(2 * torch.pi * frequency * sample)[None].float()


@pytest.mark.parametrize("transform", ALL, ids=str)
def test_a_seed_decides_the_draws_and_examples_differ(transform):
    same = windows(1).expand(40, -1, -1)
    first = transform(same, seeded(3))
    assert torch.equal(first, transform(same, seeded(3)))
    assert not torch.equal(first, transform(same, seeded(4)))
    assert any(not torch.equal(first[0], other) for other in first[1:])
    assert first.dtype == same.dtype
    assert first.shape[::2] == same.shape[::2]


@pytest.mark.parametrize("transform", ALL, ids=str)
def test_one_window_is_a_batch_of_one_and_the_global_seed_is_enough(transform):
    batch = windows(1)
    assert torch.equal(transform(batch[0], seeded(3)), transform(batch, seeded(3))[0])
    torch.manual_seed(5)
    first = transform(batch)
    torch.manual_seed(5)
    assert torch.equal(first, pickle.loads(pickle.dumps(transform))(batch))


@pytest.mark.parametrize("transform", ALL, ids=str)
def test_the_windows_that_are_given_stay_as_they_are(transform):
    batch = windows()
    before = batch.clone()
    transform(batch, seeded())
    assert torch.equal(batch, before)


@pytest.mark.parametrize("transform", ALL, ids=str)
def test_windows_of_another_device_stay_there(transform):
    """Draws of the generator's device are carried over; a mixture of devices is an error."""
    batch = torch.zeros((4, 3, 256), device="meta")
    assert transform(batch, seeded()).device.type == "meta"


@pytest.mark.parametrize("color", ["white", "pink", "brown"])
@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 25.0])
def test_noise_has_the_ratio_that_is_asked_for_in_every_channel(color, snr_db):
    signal = windows(400)
    noise = AddNoise((snr_db, snr_db), color)(signal, seeded()) - signal
    power = noise.square().mean(-1).mean(0)
    ratio = 10 * torch.log10(signal.square().mean(-1).mean(0) / power)
    assert_close(ratio, torch.full((3,), snr_db), atol=0.5, rtol=0)


def test_the_ratios_of_noise_fill_their_range():
    signal = windows(300)
    noise = AddNoise((0, 20))(signal, seeded()) - signal
    power = signal.square().mean(-1) / noise.square().mean(-1)
    ratio = 10 * torch.log10(power)
    assert_close(ratio.amin(), torch.tensor(0.0), atol=0.6, rtol=0)
    assert_close(ratio.amax(), torch.tensor(20.0), atol=0.6, rtol=0)
    assert_close(ratio[:, 0], ratio[:, 2], atol=1.0, rtol=0)  # one draw a window


@pytest.mark.parametrize(
    ("color", "exponent"), [("white", 0), ("pink", 1), ("brown", 2)]
)
def test_power_density_of_noise_falls_with_its_exponent(color, exponent):
    signal = windows(300)
    noise = AddNoise((0, 0), color)(signal, seeded()) - signal
    density = torch.fft.rfft(noise).abs().square().mean((0, 1))
    octaves = torch.log2(density[64:80].mean() / density[512:640].mean()) / 3
    assert_close(octaves, torch.tensor(float(exponent)), atol=0.1, rtol=0)


def test_noises_of_channels_are_independent():
    signal = windows()
    noise = AddNoise((0, 0))(signal, seeded()) - signal
    correlation = torch.corrcoef(noise.transpose(0, 1).flatten(1))
    off = correlation - torch.diag(torch.diag(correlation))
    assert off.abs().max() < 0.05


@pytest.mark.parametrize("db", [-20.0, 0.0, 6.0])
def test_a_gain_is_exact(db):
    signal = windows()
    assert_close(Gain((db, db))(signal), signal * 10 ** (db / 20))


def test_gains_are_one_a_window_or_one_a_channel():
    signal = windows()
    for by_channel, n_gains in ((False, 1), (True, 3)):
        gain = Gain((-6, 6), by_channel)(signal, seeded()) / signal
        assert_close(gain, gain[..., :1].expand_as(gain))
        assert all(row.round(decimals=3).unique().numel() == n_gains for row in gain)
        assert gain.min() >= 10 ** (-6 / 20) * 0.999
        assert gain.max() <= 10 ** (6 / 20) * 1.001


def test_a_shift_is_a_roll_of_all_channels_within_its_range():
    signal = windows(200)
    shifted = Shift(5)(signal, seeded())
    shifts = []
    for before, after in zip(signal, shifted, strict=True):
        (shift,) = [
            k for k in range(-5, 6) if torch.equal(before.roll(k, dims=-1), after)
        ]
        shifts.append(shift)
    assert set(shifts) == set(range(-5, 6))


@pytest.mark.parametrize("factor", [0.8, 0.97, 1.0, 1.06, 1.2])
@pytest.mark.parametrize(("frequency", "error"), [(0.2, 3e-4), (0.4, 4e-3)])
def test_resampling_moves_a_tone_by_the_factor(factor, frequency, error):
    """A tone of whole periods, so that the window begins again without a step."""
    frequency = round(frequency * N_SAMPLES) / N_SAMPLES
    result = Resample((factor, factor))(tone(frequency))
    assert_close(result, tone(frequency * factor), atol=error, rtol=0)


def test_resampling_removes_what_would_pass_half_the_rate():
    high = round(0.45 * N_SAMPLES) / N_SAMPLES
    assert Resample((1.3, 1.3))(tone(high)).abs().max() < 1e-3
    assert Resample((1.05, 1.05))(tone(high)).abs().max() > 0.9


@pytest.mark.parametrize("probability", [0.0, 0.3, 1.0])
def test_dropped_channels_are_zero_and_one_always_stays(probability):
    signal = windows(2000)
    result = DropChannels(probability)(signal, seeded())
    dropped = (result == 0).all(-1)
    assert torch.equal(result, signal * ~dropped[..., None])
    assert (~dropped).any(1).all()
    share = dropped.float().mean()
    assert_close(
        share, torch.tensor(probability - probability**3 / 3), atol=0.02, rtol=0
    )


def test_chosen_channels_are_some_of_the_window_in_its_order():
    signal = windows(200)
    result = ChooseChannels(2)(signal, seeded())
    pairs = set()
    for before, after in zip(signal, result, strict=True):
        places = [
            next(k for k, row in enumerate(before) if torch.equal(row, channel))
            for channel in after
        ]
        pairs.add(tuple(places))
    assert pairs == {(0, 1), (0, 2), (1, 2)}


def test_compose_calls_transforms_in_order_and_functions_of_others():
    signal = windows()
    doubled = Compose([Gain((20, 20)), lambda batch: batch + 1.0])(signal)
    assert_close(doubled, 10 * signal + 1.0)
    assert transformed(signal, None) is signal


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: AddNoise((30, 10)),
            r"AddNoise: snr_db=\(30, 10\) must be two numbers",
        ),
        (lambda: AddNoise((0, 1), "blue"), "color='blue'; there is white, pink, brown"),
        (lambda: Gain((0, float("nan"))), "Gain: db="),
        (lambda: Shift(-1), "samples=-1 must be at least 0"),
        (lambda: Resample((0, 1)), "must be above 0"),
        (lambda: DropChannels(1.5), "probability=1.5 must be from 0 to 1"),
        (lambda: ChooseChannels(0), "n_channels=0 must be at least 1"),
        (lambda: ChooseChannels(4)(windows()), "n_channels=4, and a window has 3"),
        (lambda: Gain((0, 1))(torch.zeros(5)), r"windows of shape \(5,\)"),
    ],
)
def test_mistakes_are_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()
