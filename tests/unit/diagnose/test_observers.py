"""Both observers on signals and tables with known answers."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnose.detectability.observers import (
    ENVELOPE_HARMONICS,
    band_indicators,
    confirmed,
    indicator_names,
    residual_energy,
    seen_by_indicators,
)

RATE, N_TEETH = 10_000.0, 20
BANDS = (500.0, 2000.0, 5000.0)
WHITE = np.ones(1)
TONE = np.sin(2.0 * math.pi * 1000.0 * np.arange(1000) / RATE)


def d_prime(residual, density=WHITE, bands=BANDS):
    return np.sqrt(np.cumsum(residual_energy(residual, density, RATE, bands), axis=-1))


@pytest.fixture
def residual():
    return np.random.default_rng(1).standard_normal((3, 2, 1001))


@pytest.mark.parametrize("n_samples", [1000, 1001])
def test_all_bands_together_are_the_energy_over_the_noise(residual, n_samples):
    x, power = residual[..., :n_samples], np.array([0.5, 4.0])
    expected = np.sum(x**2, axis=-1) / power
    total = d_prime(x, power[:, None])[..., -1] ** 2
    assert_allclose(total, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("bands", "expected"),
    [
        (BANDS, [0.0, 500.0, 0.0]),
        ((1000.0, 2000.0), [500.0, 0.0]),  # an edge belongs to the lower band
    ],
)
def test_a_tone_is_in_its_band_alone(bands, expected):
    energy = residual_energy(TONE, WHITE, RATE, bands)
    assert_allclose(energy, expected, rtol=0, atol=1e-9)


def test_without_noise_there_is_no_answer(residual):
    energy = residual_energy(residual, np.array([[1.0], [0.0]]), RATE, BANDS)
    assert np.isfinite(energy[:, 0]).all()
    assert np.isnan(energy[:, 1]).all()


def angle_of(n_samples):
    """Angle of a shaft at 25 Hz."""
    return 2.0 * math.pi * 25.0 * np.arange(n_samples) / RATE


def indicators_of(signal, angle, bands=BANDS):
    """Indicator -> (channel, band)."""
    gears = {"pinion": (N_TEETH, 1.0)}
    values = np.moveaxis(band_indicators(signal, angle, RATE, gears, bands), -1, 0)
    return dict(zip(indicator_names(["pinion"]), values, strict=True))


def table(depth, n_turns=40.0):
    """Indicators of a mesh with a bump of one tooth once a turn, in light noise, two channels."""
    angle = angle_of(int(n_turns / 25.0 * RATE))
    bump = np.exp(-0.5 * (np.angle(np.exp(1j * (angle - 1.0))) / 0.15) ** 2)
    second = 0.3 * np.cos(2 * N_TEETH * angle)
    mesh = (1.0 + depth * bump) * np.cos(N_TEETH * angle) + second
    noise = np.random.default_rng(3).standard_normal((2, len(angle)))
    return indicators_of(mesh + 0.01 * noise, angle)


def test_indicators_of_a_known_mesh():
    values = table(0.0)
    expected = 0.5 * math.log(0.5 + 0.5 * 0.3**2)
    assert_allclose(values["rms"][:, 1:], expected, rtol=0, atol=2e-3)
    # below 500 Hz there is no room for the mesh and its sidebands
    known = np.isfinite(values["fm4_pinion"])
    assert (known == [False, True, True]).all()


def test_a_bump_once_a_turn_raises_the_indicators_for_it():
    healthy, faulty = table(0.0), table(0.3)
    for kind in ("envelope", "sideband_ratio", "residual_rms"):
        name = f"{kind}_pinion"
        assert (faulty[name][:, 1] > healthy[name][:, 1] + 1.0).all(), name


@pytest.mark.parametrize(
    ("order", "low", "high"),
    [
        (2, 0.199, 0.201),
        (ENVELOPE_HARMONICS + 2, 0.0, 1e-3),
    ],
)
def test_the_envelope_counts_the_turns_of_the_gear(order, low, high):
    angle = angle_of(20_000)
    carrier = np.cos(2.0 * math.pi * 1000.0 * np.arange(20_000) / RATE)
    signal = ((1.0 + 0.2 * np.cos(order * angle)) * carrier)[None]
    values = indicators_of(signal, angle, bands=(500.0, 2000.0))
    assert low < np.exp(values["envelope_pinion"][0, 1]) < high


def test_a_record_without_a_whole_turn_has_no_indicator_of_the_gear():
    values = table(0.0, n_turns=0.9)
    assert np.isfinite(values["rms"]).all()
    for kind in ("envelope", "fm4", "residual_rms"):
        assert np.isnan(values[f"{kind}_pinion"]).all()


def groups(shift, seed=0):
    """Ten machines that differ by 1; a fault adds ``shift`` to their indicator 7."""
    sound = np.random.default_rng(seed).standard_normal((10, 200))
    faulty = sound.copy()
    faulty[:, 7] += shift
    return sound, faulty


def test_no_fault_is_not_seen_by_any_number_of_indicators():
    result = seen_by_indicators(*groups(0.0))
    assert (result.d_prime, result.auroc) == (0.0, 0.5)


@pytest.mark.parametrize("shift", [3.0, -3.0])
def test_a_shift_is_seen_by_its_size_and_in_its_direction(shift):
    results = [seen_by_indicators(*groups(shift, seed=seed)) for seed in range(40)]
    directions = {(result.indicator, result.raises) for result in results}
    assert directions == {(7, shift > 0.0)}
    assert np.mean([r.d_prime for r in results]) == pytest.approx(3.0, rel=0.05)
    assert np.mean([result.auroc for result in results]) > 0.95


@pytest.mark.parametrize("scatter", [0.0, 1.0])
def test_the_standard_error_is_the_scatter_of_d_prime(scatter):
    """Of one indicator on many sets of 12 machines, with equal and with different effects."""
    values, errors = [], []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        sound = rng.standard_normal((12, 1))
        faulty = sound + 1.0 + scatter * rng.standard_normal((12, 1))
        result = confirmed(sound, faulty, indicator=0, raises=True)
        values.append(result.d_prime)
        errors.append(result.standard_error)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(values), rel=0.2)


def test_the_best_of_many_indicators_by_chance_is_not_seen():
    """Two groups of sound machines: the best indicator seems to separate them, and does not."""
    best, seen = [], []
    for seed in range(60):
        sound, other = np.random.default_rng(seed).standard_normal((2, 8, 50))
        difference = np.abs(sound.mean(axis=0) - other.mean(axis=0))
        variance = 0.5 * (sound.var(axis=0, ddof=1) + other.var(axis=0, ddof=1))
        best.append(np.max(difference / np.sqrt(variance)))
        seen.append(seen_by_indicators(sound, other).d_prime)
    assert np.mean(best) > 1.2
    assert abs(np.mean(seen)) < 0.3


def test_confirmation_takes_the_given_direction():
    sound, faulty = groups(2.0)
    up, down = (
        confirmed(sound, faulty, indicator=7, raises=raises) for raises in (True, False)
    )
    assert up.d_prime == pytest.approx(-down.d_prime)
    assert up.auroc == pytest.approx(1.0 - down.auroc)
    assert up.d_prime > 1.0


def test_machines_without_a_value_are_left_out_and_too_few_give_no_answer():
    sound, faulty = groups(3.0)
    sound[2] = np.nan
    left = np.arange(10) != 2
    expected = seen_by_indicators(sound[left], faulty[left])
    assert seen_by_indicators(sound, faulty) == expected
    sound[:, 7] = np.nan
    assert seen_by_indicators(sound, faulty).indicator != 7
    few = seen_by_indicators(sound[:3], faulty[:3])
    assert math.isnan(few.d_prime)
    assert few.indicator == -1
