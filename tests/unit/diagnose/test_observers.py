"""Both observers on signals and tables whose answer is known."""

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


def d_prime(residual, density, bands=BANDS):
    return np.sqrt(np.cumsum(residual_energy(residual, density, RATE, bands), axis=-1))


@pytest.fixture
def residual() -> np.ndarray:
    return np.random.default_rng(1).standard_normal((3, 2, 1001))


@pytest.mark.parametrize("n_samples", [1000, 1001])
def test_all_bands_together_are_the_energy_over_the_noise(
    residual, n_samples: int
) -> None:
    x, power = residual[..., :n_samples], np.array([0.5, 4.0])[:, None]
    assert_allclose(
        d_prime(x, power)[..., -1] ** 2,
        np.sum(x**2, axis=-1) / power[:, 0],
        rtol=1e-12,
        atol=0,
    )


def test_a_tone_is_in_its_band_alone() -> None:
    tone = np.sin(2.0 * math.pi * 1000.0 * np.arange(1000) / RATE)
    assert_allclose(
        residual_energy(tone, np.ones(1), RATE, BANDS),
        [0.0, 500.0, 0.0],
        rtol=0,
        atol=1e-9,
    )
    # at the edge it belongs to the lower band
    assert_allclose(
        residual_energy(tone, np.ones(1), RATE, (1000.0, 2000.0)),
        [500.0, 0.0],
        rtol=0,
        atol=1e-9,
    )


def test_more_bandwidth_never_tells_less(residual) -> None:
    bands = np.sort(np.random.default_rng(2).uniform(10.0, 5000.0, 40))
    assert (np.diff(d_prime(residual, np.ones(1), bands), axis=-1) >= 0.0).all()


def test_six_decibels_less_noise_double_it(residual) -> None:
    assert_allclose(
        d_prime(residual, np.full(1, 0.25)),
        2.0 * d_prime(residual, np.ones(1)),
        rtol=1e-12,
        atol=0,
    )


def test_four_times_the_record_doubles_it(residual) -> None:
    assert_allclose(
        d_prime(np.tile(residual, 4), np.ones(1))[..., -1],
        2.0 * d_prime(residual, np.ones(1))[..., -1],
        rtol=1e-12,
        atol=0,
    )


def test_without_noise_there_is_no_answer(residual) -> None:
    found = residual_energy(residual, np.array([[1.0], [0.0]]), RATE, BANDS)
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1]).all()


def test_noise_elsewhere_does_not_hide_a_tone() -> None:
    """White noise of the same power does: the observer knows the spectrum."""
    tone = np.sin(2.0 * math.pi * 1000.0 * np.arange(1000) / RATE)
    low = np.where(np.fft.rfftfreq(1000, 1.0 / RATE) < 500.0, 10.0 - 9e-3, 1e-3)
    assert (
        residual_energy(tone, low, RATE, BANDS).sum()
        > 100.0 * residual_energy(tone, np.ones(1), RATE, BANDS).sum()
    )


def modulated(depth: float, n_turns: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of 20 teeth at 25 Hz with a bump of 1 tooth once a turn, in light noise; two channels, and the angle."""
    time = np.arange(int(n_turns / 25.0 * RATE)) / RATE
    angle = 2.0 * math.pi * 25.0 * time
    bump = np.exp(-0.5 * (np.angle(np.exp(1j * (angle - 1.0))) / 0.15) ** 2)
    mesh = (1.0 + depth * bump) * np.cos(N_TEETH * angle) + 0.3 * np.cos(
        2 * N_TEETH * angle
    )
    return mesh + 0.01 * np.random.default_rng(3).standard_normal((2, len(time))), angle


def table(depth: float, n_turns: float = 40.0, **changes) -> dict[str, np.ndarray]:
    signal, angle = modulated(depth, n_turns)
    values = band_indicators(
        signal, angle, RATE, {"pinion": (N_TEETH, 1.0)}, BANDS, **changes
    )
    return dict(
        zip(indicator_names(["pinion"]), np.moveaxis(values, -1, 0), strict=True)
    )


def test_indicators_of_a_known_mesh() -> None:
    found = table(0.0)
    assert_allclose(
        found["rms"][:, 1:], 0.5 * math.log(0.5 + 0.5 * 0.3**2), rtol=0, atol=2e-3
    )
    assert np.isnan(
        found["fm4_pinion"][:, 0]
    ).all()  # below 500 Hz there is no room for the mesh and its sidebands
    assert np.isfinite(found["fm4_pinion"][:, 1:]).all()


@pytest.mark.parametrize(
    "name", ["envelope_pinion", "sideband_ratio_pinion", "residual_rms_pinion"]
)
def test_a_bump_once_a_turn_raises_what_should_see_it(name: str) -> None:
    assert (table(0.3)[name][:, 1] > table(0.0)[name][:, 1] + 1.0).all()


def test_the_envelope_counts_the_turns_of_the_gear() -> None:
    time = np.arange(20_000) / RATE
    angle = 2.0 * math.pi * 25.0 * time
    for order, heard in ((2, True), (ENVELOPE_HARMONICS + 2, False)):
        signal = (
            (1.0 + 0.2 * np.cos(order * angle)) * np.cos(2.0 * math.pi * 1000.0 * time)
        )[None]
        values = band_indicators(
            signal, angle, RATE, {"pinion": (N_TEETH, 1.0)}, (500.0, 2000.0)
        )
        envelope = np.exp(
            values[0, 1, indicator_names(["pinion"]).index("envelope_pinion")]
        )
        assert envelope == pytest.approx(0.2, abs=1e-3) if heard else envelope < 1e-3


def test_a_record_without_a_whole_turn_has_no_indicator_of_the_gear() -> None:
    found = table(0.0, n_turns=0.9)
    assert np.isfinite(found["rms"]).all()
    for name in ("envelope_pinion", "fm4_pinion", "residual_rms_pinion"):
        assert np.isnan(found[name]).all()


def groups(
    shift: float, n_units: int = 10, n_indicators: int = 200, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Machines that differ by 1, and a fault that adds ``shift`` to the indicator 7 of each."""
    sound = np.random.default_rng(seed).standard_normal((n_units, n_indicators))
    faulty = sound.copy()
    faulty[:, 7] += shift
    return sound, faulty


def test_no_fault_is_not_seen_however_many_indicators_there_are() -> None:
    found = seen_by_indicators(*groups(0.0))
    assert found.d_prime == 0.0
    assert found.auroc == 0.5


@pytest.mark.parametrize("shift", [3.0, -3.0])
def test_a_shift_is_seen_by_its_size_and_in_its_direction(shift: float) -> None:
    found = [seen_by_indicators(*groups(shift, seed=seed)) for seed in range(40)]
    assert {(one.indicator, one.raises) for one in found} == {(7, shift > 0.0)}
    assert np.mean([one.d_prime for one in found]) == pytest.approx(3.0, rel=0.05)
    assert np.mean([one.auroc for one in found]) > 0.95


@pytest.mark.parametrize("own_scatter", [0.0, 1.0])
def test_the_standard_error_is_the_scatter_of_d_prime(own_scatter: float) -> None:
    """Of one indicator on many sets of 12 machines, whether the fault does the same to all of them or not."""
    found = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        sound = rng.standard_normal((12, 1))
        found.append(
            confirmed(
                sound,
                sound + 1.0 + own_scatter * rng.standard_normal((12, 1)),
                indicator=0,
                raises=True,
            )
        )
    told = np.sqrt(np.mean([one.standard_error**2 for one in found]))
    assert told == pytest.approx(np.std([one.d_prime for one in found]), rel=0.2)


def test_the_best_of_many_indicators_by_chance_is_not_seen() -> None:
    """Two groups of different sound machines: the best indicator looks as if it told them, and does not."""
    best, seen = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        sound, other = rng.standard_normal((2, 8, 50))
        difference = np.abs(sound.mean(axis=0) - other.mean(axis=0))
        best.append(
            np.max(
                difference
                / np.sqrt(0.5 * (sound.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)))
            )
        )
        seen.append(seen_by_indicators(sound, other).d_prime)
    assert np.mean(best) > 1.2
    assert abs(np.mean(seen)) < 0.3


def test_confirmation_takes_the_direction_it_is_told() -> None:
    sound, faulty = groups(2.0)
    up, down = (
        confirmed(sound, faulty, indicator=7, raises=raises) for raises in (True, False)
    )
    assert up.d_prime == pytest.approx(-down.d_prime)
    assert up.auroc == pytest.approx(1.0 - down.auroc)
    assert up.d_prime > 1.0


def test_machines_without_a_value_are_left_out_and_too_few_tell_nothing() -> None:
    sound, faulty = groups(3.0)
    sound[2] = np.nan
    left = [unit for unit in range(10) if unit != 2]
    assert seen_by_indicators(sound, faulty) == seen_by_indicators(
        sound[left], faulty[left]
    )
    sound[:, 7] = np.nan
    assert seen_by_indicators(sound, faulty).indicator != 7
    few = seen_by_indicators(sound[:3], faulty[:3])
    assert math.isnan(few.d_prime)
    assert few.indicator == -1
