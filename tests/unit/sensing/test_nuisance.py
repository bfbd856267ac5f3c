"""Nuisances by hand: orders, sizes, directions, what is drawn for whom, and bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sensing_groups import MACHINE

from gensig.errors import ConfigError
from gensig.sensing.bearing_waviness import bearing_orders
from gensig.sensing.nuisance import KINDS, draw_tones, read_nuisances

FIXED = {
    "unbalance": {
        "gear": "pinion",
        "iso21940_grade": 2.5,
        "used_share": [1.0, 1.0],
        "rated_speed_rpm": 3000,
        "rotor_mass_kg": 2.0,
    },
    "coupling_misalignment": {
        "force_share": [0.01, 0.01],
        "torque_share": [1e-3, 1e-3],
    },
    "looseness": {
        "force_share": [0.01, 0.01],
        "half_share": [0.5, 0.5],
        "n_orders": 3,
    },
    "bearing": {
        "gear": "pinion",
        "waviness_um": [0.1, 0.1],
        "slip": [0.01, 0.01],
        "n_harmonics": 2,
    },
    "neighbour_mesh": {
        "dynamic_share": [0.01, 0.01],
        "n_harmonics": 2,
        "sideband_share": [0.2, 0.2],
    },
}
# parts of the shipped machine with fixed sizes; the bearing is that of the wheel
PARTS = {part["kind"]: part | FIXED[part["kind"]] for part in MACHINE["nuisances"]}


def draw(dynamics, *parts, unit=1, specimen=1, record=1):
    units = {
        "gearbox": np.random.default_rng([0, unit]),
        "specimen": np.random.default_rng([1, specimen]),
    }
    return draw_tones(
        read_nuisances(list(parts)), dynamics, units, np.random.default_rng([2, record])
    )


@pytest.fixture(scope="module")
def dynamics(xiamen, dynamics_of):
    return dynamics_of(xiamen)


def test_every_kind_is_tested():
    assert set(PARTS) == set(KINDS)


def test_bearing_orders_are_those_of_the_textbook():
    result = bearing_orders(9, 7.94e-3, 39.04e-3, 0.0)
    assert_allclose([result.outer_race, result.inner_race], [3.585, 5.415], atol=5e-4)
    assert_allclose([result.cage, result.ball], [0.3983, 2.357], atol=5e-4)
    ratio = 7.94 / 39.04 * math.cos(0.3)
    tilted = bearing_orders(9, 7.94e-3, 39.04e-3, 0.3)
    assert_allclose(tilted.ball, 39.04 / (2 * 7.94) * (1 - ratio**2), rtol=1e-12)
    slipping = bearing_orders(9, 7.94e-3, 39.04e-3, 0.0, slip=0.02)
    assert_allclose(slipping.outer_race, 0.98 * result.outer_race, rtol=1e-12)
    assert_allclose(slipping.inner_race + slipping.outer_race, 9.0, rtol=1e-12)


def test_the_force_of_an_unbalance_of_grade_g2_5(dynamics):
    """2 kg at 3000 r/min: e = 2.5 mm/s / 314.16 rad/s = 7.958 um, and 2 kg x 7.958 um x (188.5
    rad/s)^2 = 0.5655 N."""
    (tones,) = draw(dynamics, PARTS["unbalance"])
    assert tones.follows == "speed_squared"
    assert_allclose(np.abs(tones.force), [[0.5655, 0.5655, 0.0]], rtol=1e-4)
    assert_allclose(tones.order, [1.0], rtol=0, atol=0)
    (wheel,) = draw(dynamics, {**PARTS["unbalance"], "gear": "wheel"})
    # the wheel turns slower by 23 / 84 in service and at the rated speed: e grows, w^2 falls
    assert_allclose(np.abs(wheel.force), np.abs(tones.force) * 23 / 84, rtol=1e-12)


@pytest.mark.parametrize(("gear", "sense"), [("pinion", -1.0), ("wheel", 1.0)])
def test_an_unbalance_turns_by_the_sense_of_its_gear(dynamics, gear, sense):
    (tones,) = draw(dynamics, {**PARTS["unbalance"], "gear": gear})
    turning = np.real(tones.force[0, :2] * np.exp([[0.0], [0.1j]]))
    angles = np.arctan2(turning[:, 1], turning[:, 0])
    turned = (angles[1] - angles[0] + np.pi) % (2 * np.pi) - np.pi
    assert_allclose(turned, 0.1 * sense, rtol=1e-9)


def test_orders_and_sizes_of_a_coupling(dynamics):
    (tones,) = draw(dynamics, PARTS["coupling_misalignment"])
    assert_allclose(tones.order, [2, 1, 2, 3], rtol=0, atol=0)
    assert_allclose(np.abs(tones.force[0]), [0.0, 0.0, 1e-3 * 20.0], rtol=1e-12)
    sizes = 0.01 * dynamics.mesh_force * np.array([0.5, 1.0, 0.3])
    radial = np.linalg.norm(tones.force[1:, :2], axis=1)
    assert_allclose(radial, sizes, rtol=1e-12)
    direction = tones.force[1:, 1] / tones.force[1:, 0]
    assert_allclose(direction, direction[0].real, rtol=1e-9)


def test_orders_and_sizes_of_looseness(dynamics):
    (tones,) = draw(dynamics, PARTS["looseness"])
    assert_allclose(tones.order, np.arange(1, 7) / 2, rtol=0, atol=0)
    shares = np.array([0.5, 1.0, 0.5 / 1.5, 0.5, 0.5 / 2.5, 1 / 3])
    sizes = np.linalg.norm(tones.force, axis=1)
    assert_allclose(sizes, 0.01 * dynamics.mesh_force * shares, rtol=1e-12)


def test_orders_and_sizes_of_a_bearing(dynamics):
    (tones,) = draw(dynamics, PARTS["bearing"])
    orders = bearing_orders(9, 7.94e-3, 39.04e-3, 0.0, slip=0.01)
    expected = [orders.cage]
    for k in (1, 2):
        expected += [k * orders.outer_race]
        expected += [k * orders.inner_race + side for side in (1, -1)]
        expected += [2 * k * orders.ball + side * orders.cage for side in (1, -1)]
    assert_allclose(sorted(tones.order), sorted(expected), rtol=1e-12)
    support = dynamics.pinion.support
    force = 1e-7 * np.array([support.stiffness_x, support.stiffness_y, 0.0])
    sizes = np.abs(tones.force)
    assert_allclose(sizes[0], force, rtol=1e-9)
    assert_allclose(sizes[6:], 0.5 * sizes[1:6], rtol=1e-9)
    assert np.all(tones.force[:, 2] == 0.0)


def test_orders_and_sizes_of_a_neighbour(dynamics):
    (tones,) = draw(dynamics, PARTS["neighbour_mesh"])
    sides = np.array([0.0, 1.0, -1.0, 25 / 72, -25 / 72])
    expected = np.concatenate([25 + sides, 50 + sides])
    assert_allclose(np.sort(tones.order), np.sort(expected), atol=1e-12)
    level = 0.01 * 20.0 * 84 / 23 / 29.4e-3
    direction = np.array([0.5, math.sqrt(0.75), 29.4e-3])
    for order, share in ((25.0, 1.0), (26.0, 0.2), (50.0, 0.5), (51.0, 0.1)):
        (force,) = tones.force[np.isclose(tones.order, order)]
        assert_allclose(np.abs(force), share * level * direction, rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_unit_keeps_its_sizes_from_record_to_record(dynamics, kind):
    first, *rest = (draw(dynamics, PARTS[kind], record=k)[0].force for k in range(8))
    assert_allclose(np.abs(rest), [np.abs(first)] * 7, rtol=1e-12)
    differs = kind in ("looseness", "bearing", "neighbour_mesh")
    assert any(not np.array_equal(first, force) for force in rest) == differs


@pytest.mark.parametrize("kind", KINDS)
def test_it_belongs_to_the_gearbox_or_to_the_specimen(dynamics, kind):
    (one,) = draw(dynamics, PARTS[kind])
    for level in ("gearbox", "specimen"):
        words = {"gearbox": {"unit": 2}, "specimen": {"specimen": 2}}[level]
        (other,) = draw(dynamics, PARTS[kind], **words)
        is_its_own = level == KINDS[kind].level
        assert np.array_equal(other.force, one.force) != is_its_own


def test_a_part_more_at_the_end_changes_no_other(dynamics):
    parts = list(PARTS.values())
    few, more = draw(dynamics, *parts[:-1]), draw(dynamics, *parts)
    assert len(more) == len(few) + 1
    for one, other in zip(few, more, strict=False):
        assert np.array_equal(one.force, other.force)
        assert np.array_equal(one.base, other.base)


def test_ranges_are_filled_and_kept(dynamics):
    part = {**PARTS["unbalance"], "used_share": [0.2, 0.8]}
    result = [
        abs(draw(dynamics, part, specimen=k)[0].force[0, 0]) / 0.5655
        for k in range(200)
    ]
    assert 0.2 <= min(result) < 0.23
    assert 0.77 < max(result) <= 0.8001
    part = {**PARTS["bearing"], "slip": [0.0, 0.02]}
    cages = [draw(dynamics, part, record=k)[0].base[1] for k in range(100)]
    free = bearing_orders(9, 7.94e-3, 39.04e-3, 0.0).cage
    assert free * 0.98 <= min(cages) < max(cages) <= free


@pytest.mark.parametrize("kind", KINDS)
def test_numbers_stay_within_their_limits(kind):
    cls = KINDS[kind]
    (part,) = read_nuisances([PARTS[kind]])
    for name, (low, high) in cls.limits.items():
        for value in (low - 1, 2 * high):
            with pytest.raises(ConfigError, match=rf"^{name}.* must lie in"):
                replace(part, **{name: value})
    for name, (low, high) in cls.ranges.items():
        for ends in ((low - 1, high), (high, low), (low, 2 * high), (low,)):
            with pytest.raises(ConfigError, match=rf"^{name}.* must be two ordered"):
                replace(part, **{name: ends})
