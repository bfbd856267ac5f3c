"""Taking a mesh apart by the teeth of both gears: each gear gets its own part, whatever the other
does."""

from math import tau

import numpy as np
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.indicators import rms
from gensig.signals.separation import separate_gears

TEETH, RATE, SAMPLES = (5, 12), 6400.0, 32
PARTS = ("driving", "driven", "mesh")
MESH_HZ = 100.0  # 64 samples a passage


def a_pair(n_passages, *, teeth=TEETH, noise=0.0, seed=0):
    """Signal (2, sample) and its parts: sines of three orders of the mesh, of another size on
    every tooth."""
    rng = np.random.default_rng(seed)
    sizes = [rng.standard_normal((z, 2, 3)) for z in teeth]
    sizes = [size - size.mean(axis=0) for size in sizes]
    mesh = rng.standard_normal((2, 3))

    def waves(size, per_passage):
        """Passages of given sizes, (passage, channel, order), one after the other."""
        t = np.arange(per_passage) / per_passage
        orders = np.arange(1, 4)[:, None]
        shape = np.sin(np.pi * t) ** 2 * np.sin(2 * np.pi * orders * t)
        return np.einsum("pco,os->cps", size, shape).reshape(2, -1)

    passage = np.arange(n_passages)
    driving, driven = (size[passage % z] for size, z in zip(sizes, teeth, strict=True))
    signal = waves(mesh + driving + driven, 64)
    signal += noise * rng.standard_normal(signal.shape)
    return signal, [waves(size, SAMPLES) for size in (*sizes, mesh[None])]


def separate(signal, **changes):
    options = {"mesh_frequency": MESH_HZ, "n_teeth": TEETH, **changes}
    return separate_gears(signal, RATE, **options, samples_per_tooth=32)


def test_every_part_comes_back():
    signal, parts = a_pair(130)
    result = separate(signal + 7.0)
    for name, expected in zip(PARTS, parts, strict=True):
        part = getattr(result, name)
        assert part.shape == expected.shape
        assert_allclose(
            part,
            expected,
            atol=0.03 * np.abs(signal).max(),
        )


def test_it_is_linear_and_blind_to_what_is_constant():
    (a, _), (b, _) = a_pair(100, seed=1), a_pair(100, seed=2)
    both, first, second = (separate(x) for x in (a + 2 * b - 3.0, a, b))
    for name in PARTS:
        expected = getattr(first, name) + 2 * getattr(second, name)
        assert_allclose(getattr(both, name), expected, atol=1e-9)


def test_noise_falls_with_the_passages_of_a_tooth():
    errors = []
    for n_passages in (60, 240):
        clean, _ = a_pair(n_passages)
        noisy, _ = a_pair(n_passages, noise=1.0)
        errors.append(np.std(separate(noisy).driving - separate(clean).driving))
    assert_allclose(
        errors[0] / errors[1],
        2.0,
        rtol=0.15,
    )


def test_what_lies_above_half_the_samples_is_taken_away_and_does_not_alias():
    t = np.arange(64 * 100)
    is_loud = t // 64 % TEETH[0] == 2
    high = np.sin(tau * 24 * t / 64)[None] * is_loud
    assert rms(separate(high).driving).max() < 0.1 * rms(high).min()


def test_less_than_a_turn_and_odd_samples_are_refused():
    with refused("4 passages of a tooth, less than 5", ValueError):
        separate(np.zeros((1, 64 * 4)))
    with refused("even and at least 2, not 31", ValueError):
        separate_gears(
            np.zeros((1, 6400)),
            RATE,
            MESH_HZ,
            TEETH,
            samples_per_tooth=31,
        )
