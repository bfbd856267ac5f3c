"""Laws of implants: what is added, at which level, and how it turns."""

import inspect
from dataclasses import fields, replace

import numpy as np
import pytest
from implant_samples import CARRIER_TEETH, KNOCK_HZ, carrier

import gensig
from gensig.implants.carriers import healthy_recording
from gensig.implants.gearing import Gearing
from gensig.implants.implanting import Implanter, implant_records
from gensig.implants.options import RESIDUALS, ImplantOptions
from gensig.implants.simulated_pairs import CLASSES, HEALTHY, MANY_TEETH, ONE_TOOTH
from gensig.implants.stretching import FADE, REACH, Played
from gensig.signals.indicators import kurtosis

SMALL = ImplantOptions(n_records=72, path="none", duration=0.45, plain_healthy=0.0)


def implanter(pairs, recordings, teeth=CARRIER_TEETH, speed=900.0, **choices):
    taken = [healthy_recording(each, f"h{k}") for k, each in enumerate(recordings)]
    options = replace(SMALL, **choices)
    return Implanter(pairs, taken, Gearing(teeth=teeth), [speed], options)


def of_class(made, name, n_records=None):
    chosen = [k for k, draw in enumerate(made.plan.draws) if draw.name == name]
    return chosen[:n_records]


def added(made, index):
    return made.record(index).astype(float) - made.stretch(index)


def level_db(made, index):
    ratio = added(made, index).std(axis=1) / made.stretch(index).std(axis=1)
    return 20.0 * np.log10(ratio)


def test_no_residual_leaves_the_samples_of_the_carrier(pairs, healthy):
    made = implanter(pairs, healthy, residual="none")
    for index, draw in enumerate(made.plan.draws[:6]):
        own = healthy[draw.block.recording].acceleration
        stretch = own[:, draw.start : draw.start + made.cut.n_samples]
        np.testing.assert_array_equal(made.record(index), stretch.astype(np.float32))
        assert np.isnan(draw.gain_db)


@pytest.mark.parametrize("path", ["none", "twin"])
@pytest.mark.parametrize("residual", [kind for kind in RESIDUALS if kind != "none"])
def test_every_class_gets_the_level_that_was_drawn(pairs, healthy, residual, path):
    made = implanter(pairs, healthy, residual=residual, path=path)
    for name in CLASSES:
        for index in of_class(made, name, 2):
            drawn = made.plan.draws[index].gain_db
            np.testing.assert_allclose(level_db(made, index), drawn, atol=0.05)


def test_a_share_of_the_healthy_records_carries_nothing(pairs, healthy):
    made = implanter(
        pairs, healthy, n_records=900, plain_healthy=ImplantOptions().plain_healthy
    )
    plain = {draw.name: [] for draw in made.plan.draws}
    for draw in made.plan.draws:
        plain[draw.name].append(np.isnan(draw.gain_db))
    assert not any(plain[ONE_TOOTH] + plain[MANY_TEETH])
    assert np.mean(plain[HEALTHY]) == pytest.approx(0.5, abs=0.1)
    index = of_class(made, HEALTHY)[plain[HEALTHY].index(True)]
    stretch = made.stretch(index).astype(np.float32)
    np.testing.assert_array_equal(made.record(index), stretch)


def test_gains_are_uniform_and_the_same_for_all_classes(pairs, healthy):
    made = implanter(pairs, healthy, n_records=3000, gain_db=(-4.0, 6.0))
    for name in CLASSES:
        gains = [made.plan.draws[k].gain_db for k in of_class(made, name)]
        assert min(gains) >= -4.0
        assert max(gains) <= 6.0
        np.testing.assert_allclose(np.mean(gains), 1.0, atol=0.3)
        np.testing.assert_allclose(np.std(gains), 10.0 / 12**0.5, atol=0.2)


def test_records_of_a_condition_and_class_are_counted_from_0(pairs, healthy):
    columns = implanter(pairs, healthy).plan.table.columns
    numbers = {}
    keys = zip(columns["condition_id"], columns["label"], strict=True)
    for key, number in zip(keys, columns["repeat"], strict=True):
        numbers.setdefault(key, []).append(int(number))
    assert len(numbers) > len(CLASSES)
    for given in numbers.values():
        assert given == list(range(len(given)))


def test_python_has_the_defaults_of_the_command():
    given = inspect.signature(gensig.implant).parameters
    names = [field.name for field in fields(ImplantOptions) if field.name in given]
    assert len(names) >= 7
    for name in names:
        assert given[name].default == getattr(ImplantOptions(), name), name


def test_a_loop_plays_the_signal_and_fades_at_its_seam():
    turned = np.arange(2001) / 100.0
    signal = np.sin(0.3 * turned)[None]
    played = Played(signal, turned, per_turn=100.0)
    begin, n_turns = REACH / 100.0, played.n_turns
    turns = np.linspace(FADE, n_turns - 1e-6, 1000)
    for loop in range(3):
        expected = np.sin(0.3 * (begin + turns))
        found = played.at(turns + loop * n_turns)[0]
        np.testing.assert_allclose(found, expected, atol=1e-3)
    assert abs(found[-1] - found[0]) > 0.2  # so that the ends of a loop differ
    seam = n_turns + np.linspace(-FADE, FADE, 401)
    assert np.abs(np.diff(played.at(seam)[0])).max() < 0.01


def test_starts_gears_and_channels_tell_no_class(pairs, healthy):
    made = implanter(pairs, healthy, n_records=3000)
    means = {}
    for name in CLASSES:
        draws = [made.plan.draws[k] for k in of_class(made, name)]
        values = [
            (d.start - d.block.start, 400 * d.gear, 800 * d.channel) for d in draws
        ]
        means[name] = np.mean(values, axis=0)
    for name in (ONE_TOOTH, MANY_TEETH):
        np.testing.assert_allclose(means[name], means[HEALTHY], atol=150)


def knock_angles(signal, turned):
    """Share of a turn at which a knock begins, one a turn."""
    from scipy.signal import hilbert

    envelope = np.abs(hilbert(signal))
    whole = np.arange(1, int(turned[-1]))
    angles = []
    for turn in whole:
        inside = np.flatnonzero((turned >= turn - 0.5) & (turned < turn + 0.5))
        angles.append(turned[inside[envelope[inside].argmax()]] % 1.0)
    return np.array(angles)


def test_a_missing_tooth_knocks_once_a_turn_of_the_wandering_shaft(pairs):
    recording, turns = carrier(3, seconds=24.0, wander=0.02)
    made = implanter(pairs, [recording], duration=1.4, n_records=48)
    for index in of_class(made, ONE_TOOTH, 4):
        draw = made.plan.draws[index]
        own = turns[draw.start : draw.start + made.cut.n_samples]
        turned = own - own[0]
        residual = added(made, index)[0]
        first = turned[np.abs(residual).argmax()]
        # angles about the strongest knock, so that none lies at the seam of a turn
        angles = knock_angles(residual, turned - (first % 1.0) + 1.0)
        apart = (angles + 0.5) % 1.0 - 0.5
        assert len(angles) > 15
        # the sample before and after the begin of a knock, and its rise
        assert np.abs(apart - np.median(apart)).max() < 0.01
        assert kurtosis(residual) > 8.0


def test_a_steady_clock_does_not_follow_that_shaft(pairs):
    """The twin of the law above: at the mean speed the angles drift."""
    recording, turns = carrier(3, seconds=24.0, wander=0.02)
    made = implanter(pairs, [recording], duration=1.4, n_records=48)
    drifts = []
    for index in of_class(made, ONE_TOOTH, 4):
        start = made.plan.draws[index].start
        own = turns[start : start + made.cut.n_samples]
        steady = np.linspace(0.0, own[-1] - own[0], made.cut.n_samples)
        residual = added(made, index)[0]
        first = steady[np.abs(residual).argmax()]
        angles = knock_angles(residual, steady - (first % 1.0) + 1.0)
        apart = (angles + 0.5) % 1.0 - 0.5
        drifts.append(np.abs(apart - np.median(apart)).max())
    assert max(drifts) > 0.05


def test_frequencies_change_by_the_ratio_of_the_speeds(pairs):
    recording, _ = carrier(3, seconds=24.0, wander=0.0)
    made = implanter(pairs, [recording], duration=1.4, n_records=48)
    (index,) = of_class(made, ONE_TOOTH, 1)
    residual = added(made, index)[0]
    spectrum = np.abs(np.fft.rfft(residual)) ** 2
    frequency = np.fft.rfftfreq(
        residual.size, 1.0 / made.carriers[0].recording.sampling_rate
    )
    center = np.sum(frequency * spectrum) / np.sum(spectrum)
    gear = made.plan.draws[index].gear
    played = 900.0 * made.gearing.turns(gear) / 1200.0
    assert center == pytest.approx(played * KNOCK_HZ, rel=0.05)


def test_kinds_of_residuals(pairs, healthy):
    physics, bursts, shuffled = (
        implanter(pairs, healthy, residual=kind)
        for kind in ("physics", "noise_bursts", "shuffled_phases")
    )
    index = of_class(physics, ONE_TOOTH, 1)[0]
    peaky = [
        float(kurtosis(added(made, index)[0])) for made in (physics, bursts, shuffled)
    ]
    assert peaky[0] > 8.0
    assert peaky[1] > 8.0
    assert peaky[2] < 5.0
    power = [
        np.abs(np.fft.rfft(added(made, index)[0])) ** 2 for made in (physics, shuffled)
    ]
    np.testing.assert_allclose(
        power[0][1:], power[1][1:], rtol=0.02, atol=1e-3 * power[0].max()
    )
    assert kurtosis(added(bursts, of_class(bursts, HEALTHY, 1)[0])[0]) < 3.5


def test_the_plan_is_the_same_for_every_residual(pairs, healthy):
    plans = [implanter(pairs, healthy, residual=kind).plan for kind in RESIDUALS[:3]]
    assert plans[0].draws == plans[1].draws == plans[2].draws


def test_the_same_seed_gives_the_same_bits_in_any_order(pairs, healthy):
    one, other = implanter(pairs, healthy), implanter(pairs, healthy)
    last = one.record(5)
    first = one.record(2)
    np.testing.assert_array_equal(first, other.record(2))
    np.testing.assert_array_equal(last, other.record(5))
    assert not np.array_equal(first, implanter(pairs, healthy, seed=1).record(2))


def test_several_channels_and_stages():
    gearing = Gearing(teeth=(20, 30, 16, 40))
    assert gearing.names[2] == "stage_2_pinion"
    assert gearing.turns(1) == gearing.turns(2) == pytest.approx(2.0 / 3.0)
    assert gearing.turns(3) == pytest.approx(2.0 / 3.0 * 0.4)
    assert gearing.mesh_order(2) == gearing.mesh_order(3) == pytest.approx(32.0 / 3.0)
    assert gearing.of_role("pinion") == (0, 2)


def test_two_stages_turn_with_the_shaft_of_the_fault(pairs):
    teeth = (20, 30, 16, 40)
    recording, turns = carrier(4, seconds=40.0, teeth=teeth, n_channels=2)
    made = implanter(pairs, [recording], teeth=teeth, duration=2.0)
    gears = {draw.gear for draw in made.plan.draws}
    assert gears == {0, 2}  # faults of the pinion: driving gears
    index = next(k for k in of_class(made, ONE_TOOTH) if made.plan.draws[k].gear == 2)
    draw = made.plan.draws[index]
    own = turns[draw.start : draw.start + made.cut.n_samples]
    turned = (own - own[0]) * made.gearing.turns(2)
    residual = added(made, index)
    assert residual.shape[0] == 2
    first = turned[np.abs(residual[0]).argmax()]
    angles = knock_angles(residual[0], turned - (first % 1.0) + 1.0)
    assert len(angles) > 15
    assert np.std((angles + 0.5) % 1.0) < 0.02


def test_in_memory(pairs, healthy):
    made = implant_records(
        pairs, healthy, teeth=CARRIER_TEETH, speed_rpm=900, options=SMALL
    )
    assert made.acceleration.shape[:2] == (72, 1)
    assert made.acceleration.dtype == np.float32
    assert made.class_names == CLASSES
    assert np.bincount(made.label).tolist() == [24, 24, 24]
    held = {block.number for block in made.blocks if not block.carries}
    assert held
    assert not held & set(made.block.tolist())


def test_a_tacho_gives_the_angle(pairs):
    recording, turns = carrier(5, seconds=8.0, wander=0.02)
    pulses = (np.mod(turns, 1.0) < 0.1).astype(float)
    taken = replace(healthy_recording(recording, "h"), tacho=pulses)
    made = Implanter(pairs, [taken], Gearing(teeth=CARRIER_TEETH), [900.0], SMALL)
    inside = slice(1000, -1000)
    apart = (made.carriers[0].turned - turns)[inside]
    assert np.ptp(apart) < 0.01
