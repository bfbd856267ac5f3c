"""Speed of the input shaft from the mesh of any stage, and what is refused."""

import numpy as np
import pytest
from fake_gearbox import RATE, SPEED, STAGES, Box

from diagnose.detection.followed_shafts import Tacho, follow_shafts
from diagnose.detection.gear_stages import stages_of
from gensig.errors import ConfigError, TooShortError
from gensig.signals.recording import Recording


@pytest.mark.parametrize("stated", [SPEED, 0.975 * SPEED, 1.025 * SPEED])
@pytest.mark.parametrize("seconds", [2.5, 0.6])
def test_speed_is_found_within_three_percent(stated, seconds):
    followed = follow_shafts(Box().record(seconds=seconds), STAGES, stated, name="a")
    assert abs(followed.speed_rpm / SPEED - 1.0) < 5e-4


def test_slow_wander_is_followed():
    followed = follow_shafts(Box().record(wander=0.003), STAGES, SPEED, name="a")
    turns = followed.signal.reshape(1, -1, followed.samples_per_turn)
    spectrum = np.abs(np.fft.rfft(turns.reshape(-1)))
    n_turns = turns.shape[1]
    line = 32 * n_turns  # mesh of stage 1, an exact bin once the speed is followed
    assert spectrum[line] > 5.0 * np.delete(spectrum[line - 6 : line + 7], 6).max()


def test_tacho_needs_no_speed():
    recording = Box().record()
    time = np.arange(recording.acceleration.shape[1]) / RATE
    pulses = ((time * SPEED / 60.0) % 1.0 < 0.2).astype(float)
    tacho = Tacho(name="pulses", signal=pulses)
    followed = follow_shafts(recording, STAGES, None, name="a", tacho=tacho)
    assert followed.by == "tacho"
    assert abs(followed.speed_rpm / SPEED - 1.0) < 1e-3


def test_too_few_turns_are_refused_with_the_length_needed():
    with pytest.raises(
        TooShortError, match=r"turns of the slowest shaft.*record 0.458 s"
    ):
        follow_shafts(Box().record(seconds=0.4), STAGES, SPEED, name="a")


def test_another_speed_is_refused_with_the_one_found():
    with pytest.raises(ConfigError, match=r"but one as of 174\d"):
        follow_shafts(Box().record(), STAGES, 1500.0, name="a")


def test_noise_has_no_mesh():
    noise = np.random.default_rng(3).standard_normal((1, 12_500))
    recording = Recording(sensors=("a",), acceleration=noise, sampling_rate=RATE)
    with pytest.raises(ConfigError, match=r"no mesh found near 931\S* 558\S* Hz"):
        follow_shafts(recording, STAGES, SPEED, name="a")


def test_two_meshes_within_three_percent_are_ambiguous():
    first, second = Box().record(), Box(seed=5).record(speed_rpm=1.02 * SPEED)
    both = Recording(
        sensors=("a",),
        acceleration=first.acceleration + second.acceleration,
        sampling_rate=RATE,
    )
    with pytest.raises(ConfigError, match=r"several speeds alike, 17\S+, 17\S+ r/min"):
        follow_shafts(both, STAGES, 1.01 * SPEED, name="a")


def test_slow_rates_and_missing_speeds_are_refused():
    with pytest.raises(ConfigError, match="at least 5000"):
        follow_shafts(Box().record(rate=4000.0), STAGES, SPEED, name="a")
    with pytest.raises(ConfigError, match="give --speed-rpm, or --tacho"):
        follow_shafts(Box().record(), STAGES, None, name="a")


def test_a_speed_in_hertz_is_asked_back():
    with pytest.raises(ConfigError, match=r"Then say 1746"):
        follow_shafts(Box().record(), STAGES, 29.1, name="a")


@pytest.mark.parametrize("teeth", [(), (32,), (32, 80, 48)])
def test_teeth_come_in_pairs(teeth):
    with pytest.raises(ConfigError, match="DRIVING DRIVEN of every stage"):
        stages_of(teeth)


def test_gears_of_few_teeth_are_refused():
    with pytest.raises(ConfigError, match="4 to 1000 teeth"):
        stages_of((3, 80))


def test_orders_and_names_of_three_stages():
    stages = stages_of((20, 40, 20, 60, 30, 15))
    np.testing.assert_allclose(stages.shaft_orders, (1.0, 0.5, 1 / 6, 1 / 3))
    np.testing.assert_allclose(stages.mesh_orders, (20.0, 10.0, 5.0))
    assert stages.shafts[1:] == (
        "intermediate shaft 1",
        "intermediate shaft 2",
        "output shaft",
    )
    assert [gear.n_teeth for gear in stages.gears(2)] == [60, 30]
    assert stages.slowest == pytest.approx(1 / 6)
