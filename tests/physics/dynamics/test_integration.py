"""What a record may say: error of the integration, settling, speed, and the sideband proof."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack

SAMPLING_RATE = 51200.0
MISSING = MissingTooth(gear="pinion", tooth=3)


def in_band(acceleration):
    """Spectrum from 20 Hz to 20 kHz under a Hann window, (channel, line)."""
    n = acceleration.shape[-1]
    frequency = np.fft.rfftfreq(n, 1 / SAMPLING_RATE)
    return np.fft.rfft(acceleration * np.hanning(n), axis=-1)[
        :, (frequency >= 20) & (frequency <= 20e3)
    ]


@pytest.fixture(scope="module")
def errors(machine):
    """Largest relative error of a channel by oversampling, against 64."""

    def spectrum(oversampling):
        changes = {
            "operating.duration_s": 0.05,
            "solver.oversampling": oversampling,
            "solver.max_error": None,
        }
        system = machine(changes)
        return in_band(system.simulate().acceleration)

    exact = spectrum(64)
    return {
        n: (
            np.linalg.norm(spectrum(n) - exact, axis=1) / np.linalg.norm(exact, axis=1)
        ).max()
        for n in (4, 5, 8, 16)
    }


class TestOrderOfConvergence:
    def test_order(self, errors):
        order = math.log2(errors[4] / errors[16]) / 2
        assert order > 3.0

    def test_error_at_the_default_oversampling(self, errors, composed_config):
        """As docs/theory/spur_dynamics.md tabulates it."""
        assert errors[composed_config["solver"]["oversampling"]] < 2e-4
        assert errors[8] < 5e-5

    def test_four_steps_are_visibly_coarser(self, errors):
        assert 3e-4 < errors[4] < 1e-3


@pytest.mark.parametrize(
    ("speed_rpm", "samples_per_turn"), [(1500, 2048), (1200, 2560)]
)
class TestSettled:
    def test_turns_agree(self, machine, speed_rpm, samples_per_turn):
        duration = 4 * samples_per_turn / SAMPLING_RATE
        system = machine(
            {"operating.speed_rpm": speed_rpm, "operating.duration_s": duration}
        )
        turns = system.simulate().acceleration.reshape(4, 4, samples_per_turn)
        change = np.sqrt(np.mean(np.diff(turns, axis=1) ** 2, axis=-1)).max(axis=1)
        assert np.all(change < 1e-3 * np.sqrt(np.mean(turns**2, axis=(1, 2))))

    def test_a_cut_that_is_no_turn_does_not_agree(
        self, machine, speed_rpm, samples_per_turn
    ):
        duration = 4 * samples_per_turn / SAMPLING_RATE
        system = machine(
            {"operating.speed_rpm": speed_rpm, "operating.duration_s": duration}
        )
        signal = system.simulate().acceleration
        shift = samples_per_turn - 7
        change = np.sqrt(
            np.mean((signal[:, shift : 2 * shift] - signal[:, :shift]) ** 2, axis=-1)
        )
        assert np.all(change > 0.1 * np.sqrt(np.mean(signal**2, axis=-1)))


class TestSpeed:
    @pytest.mark.parametrize(
        ("speed_rpm", "torque_nm"), [(1800, 20), (1800, 100), (900, 5)]
    )
    def test_mean_speed_is_the_set_speed_and_does_not_tell_the_fault(
        self, machine, speed_rpm, torque_nm
    ):
        system = machine(
            {
                "operating.speed_rpm": speed_rpm,
                "operating.torque_nm": torque_nm,
                "operating.duration_s": 0.4,
            }
        )
        speeds = [
            system.simulate(faults).mean_speed / system.operating.speed
            for faults in ((), (MISSING,))
        ]
        assert_allclose(speeds, 1.0, rtol=0, atol=1e-5)

    def test_a_source_far_too_soft_would_show(self, machine):
        system = machine(
            {"operating.duration_s": 0.4, "operating.drive_frequency_hz": 0.2}
        )
        assert (
            abs(system.simulate((MISSING,)).mean_speed / system.operating.speed - 1)
            > 1e-5
        )


def sideband_level(system, turns, faults=()):
    """Strongest line at mesh +- n x shaft over the strongest mesh harmonic, per channel, up to 20 kHz.

    Order spectrum over whole turns of the pinion, no window; below half the mesh order only the drive is left.
    """
    amplitude = np.abs(np.fft.rfft(system.simulate(faults).acceleration, axis=-1))[
        :, ::turns
    ]
    n_teeth = system.pair.pinion.n_teeth
    order = np.arange(amplitude.shape[1])
    usable = (order > n_teeth // 2) & (
        order * system.operating.speed / (2 * np.pi) <= 20e3
    )
    mesh = order % n_teeth == 0
    return amplitude[:, usable & ~mesh].max(axis=1) / amplitude[:, usable & mesh].max(
        axis=1
    )


@pytest.mark.parametrize(("speed_rpm", "turns"), [(1800, 15), (1500, 10)])
class TestSidebandProof:
    """Perfect healthy teeth have no sidebands (docs/theory/spur_dynamics.md)."""

    def level(self, machine, speed_rpm, turns, faults=(), **solver):
        changes = {
            "operating.speed_rpm": speed_rpm,
            "operating.duration_s": turns * 60 / speed_rpm,
            **{f"solver.{key}": value for key, value in solver.items()},
        }
        return sideband_level(machine(changes), turns, faults)

    def test_at_the_default_oversampling(self, machine, speed_rpm, turns):
        assert self.level(machine, speed_rpm, turns).max() < 1e-4

    def test_at_sixteen_steps(self, machine, speed_rpm, turns):
        assert self.level(machine, speed_rpm, turns, oversampling=16).max() < 1e-5

    def test_a_small_crack_shows(self, machine, speed_rpm, turns):
        crack = Crack(
            gear="pinion",
            tooth=3,
            crack_depth=0.5e-3,
            crack_angle=np.pi / 4,
            crack_start="arc_mid",
        )
        assert self.level(machine, speed_rpm, turns, (crack,)).max() > 5e-4
