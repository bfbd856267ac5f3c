"""Nuisances by hand: orders, sizes, directions, what is drawn for whom, and bad input."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from sensing_groups import MACHINE

from gensig.dynamics.response import linear_pair
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


BEARING = (9, 7.94e-3, 39.04e-3)  # balls, their diameter, pitch diameter


@pytest.fixture(scope="module")
def running(xiamen, running_of):
    return running_of(xiamen)


@pytest.fixture(scope="module")
def draw(running):
    """Function that draws the tones of parts for a gearbox, a specimen and a record."""

    def make(*parts, gearbox=1, specimen=1, record=1):
        units = {
            "gearbox": default_rng([0, gearbox]),
            "specimen": default_rng([1, specimen]),
        }
        nuisances = read_nuisances(list(parts))
        return draw_tones(
            nuisances,
            linear_pair(running),
            units,
            default_rng([2, record]),
        )

    return make


@pytest.fixture(scope="module")
def tones_of(draw):
    """Function that draws the tones of one kind, with keys of its part replaced."""

    def make(kind, changes=None, **numbers):
        (tones,) = draw(
            PARTS[kind] | (changes or {}),
            **numbers,
        )
        return tones

    return make


def test_every_kind_is_tested():
    assert set(PARTS) == set(KINDS)


def test_bearing_orders_are_those_of_the_textbook():
    result = bearing_orders(*BEARING, 0.0)
    assert_allclose(
        [result.outer_race, result.inner_race],
        [3.585, 5.415],
        atol=5e-4,
    )
    assert_allclose(
        [result.cage, result.ball],
        [0.3983, 2.357],
        atol=5e-4,
    )

    ratio = 7.94 / 39.04 * math.cos(0.3)
    tilted = bearing_orders(*BEARING, 0.3)
    assert_allclose(
        tilted.ball,
        39.04 / (2 * 7.94) * (1 - ratio**2),
    )

    slipping = bearing_orders(*BEARING, 0.0, slip=0.02)
    assert_allclose(slipping.outer_race, 0.98 * result.outer_race)
    assert_allclose(slipping.inner_race + slipping.outer_race, 9.0)


def test_the_force_of_an_unbalance_of_grade_g2_5(tones_of):
    """2 kg at 3000 r/min: e = 2.5 mm/s / 314.16 rad/s = 7.958 um, and 2 kg x 7.958 um x (188.5
    rad/s)^2 = 0.5655 N."""
    tones = tones_of("unbalance")
    assert tones.follows == "speed_squared"
    assert_allclose(
        np.abs(tones.force),
        [[0.5655, 0.5655, 0.0]],
        rtol=1e-4,
    )
    assert_array_equal(tones.order, [1.0])

    wheel = tones_of("unbalance", {"gear": "wheel"})
    # the wheel turns slower by 23 / 84 in service and at the rated speed: e grows, w^2 falls
    assert_allclose(
        np.abs(wheel.force),
        np.abs(tones.force) * 23 / 84,
    )


@pytest.mark.parametrize(
    ("gear", "sense"),
    [("pinion", -1.0), ("wheel", 1.0)],
)
def test_an_unbalance_turns_by_the_sense_of_its_gear(tones_of, gear, sense):
    force = tones_of("unbalance", {"gear": gear}).force[0, :2]
    before, after = (np.real(force * np.exp(1j * angle)) for angle in (0.0, 0.1))
    crossed = before[0] * after[1] - before[1] * after[0]
    turned = np.arctan2(crossed, before @ after)

    assert_allclose(turned, 0.1 * sense)


def test_orders_and_sizes_of_a_coupling(running, tones_of):
    tones = tones_of("coupling_misalignment")
    assert_array_equal(tones.order, [2, 1, 2, 3])

    torque, force = tones.force[0], tones.force[1:]
    assert_allclose(
        np.abs(torque),
        [0.0, 0.0, 1e-3 * 20.0],
    )

    sizes = 0.01 * running.mesh_force * np.array([0.5, 1.0, 0.3])
    assert_allclose(
        np.linalg.norm(force[:, :2], axis=1),
        sizes,
    )

    direction = force[:, 1] / force[:, 0]
    assert_allclose(direction, direction[0].real)


def test_orders_and_sizes_of_looseness(running, tones_of):
    tones = tones_of("looseness")
    assert_array_equal(
        tones.order,
        np.arange(1, 7) / 2,
    )

    shares = np.array([0.5, 1.0, 0.5 / 1.5, 0.5, 0.5 / 2.5, 1 / 3])
    sizes = np.linalg.norm(tones.force, axis=1)
    assert_allclose(sizes, 0.01 * running.mesh_force * shares)


def test_orders_and_sizes_of_a_bearing(running, tones_of):
    tones = tones_of("bearing")
    orders = bearing_orders(*BEARING, 0.0, slip=0.01)
    expected = [orders.cage]
    for k in (1, 2):
        expected.append(k * orders.outer_race)
        for side in (1, -1):
            expected.append(k * orders.inner_race + side)
            expected.append(2 * k * orders.ball + side * orders.cage)

    assert_allclose(sorted(tones.order), sorted(expected))

    support = running.pinion.support
    force = 1e-7 * np.array([support.stiffness_x, support.stiffness_y, 0.0])
    sizes = np.abs(tones.force)
    assert_allclose(sizes[0], force)
    assert_allclose(
        sizes[6:],
        0.5 * sizes[1:6],
    )
    assert np.all(tones.force[:, 2] == 0.0)


def test_orders_and_sizes_of_a_neighbour(tones_of):
    tones = tones_of("neighbour_mesh")
    sides = np.array([0.0, 1.0, -1.0, 25 / 72, -25 / 72])
    expected = np.concatenate([25 + sides, 50 + sides])

    assert_allclose(
        np.sort(tones.order),
        np.sort(expected),
    )

    level = 0.01 * 20.0 * 84 / 23 / 29.4e-3
    direction = np.array([0.5, math.sqrt(0.75), 29.4e-3])
    for harmonic, share in ((25.0, 1.0), (50.0, 0.5)):
        for order, of_line in zip(harmonic + sides, (1.0, *4 * (0.2,)), strict=True):
            (force,) = tones.force[np.isclose(tones.order, order)]
            assert_allclose(np.abs(force), of_line * share * level * direction)


@pytest.mark.parametrize(
    ("gear", "turn"),
    [("pinion", "pinion_rotation"), ("wheel", "wheel_rotation")],
)
def test_a_neighbour_turns_a_gear_as_the_set_torque_does(running, tones_of, gear, turn):
    """Its mesh is what drives a driving gear and what holds a driven one back."""
    tones = tones_of("neighbour_mesh", {"gear": gear})
    outside = running.dynamics.forces(np.zeros(1))[0][running.dofs.index(turn)]
    along = tones.force[:, 0] / math.cos(math.radians(60))
    arm = tones.force[:, 2] / along

    assert_allclose(arm, np.sign(outside) * 29.4e-3, rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_unit_keeps_its_sizes_from_record_to_record(tones_of, kind):
    forces = np.array([tones_of(kind, record=k).force for k in range(8)])
    sizes = np.abs(forces)
    assert_allclose(
        sizes,
        sizes[:1].repeat(8, axis=0),
    )

    differs = kind in ("looseness", "bearing", "neighbour_mesh")
    assert np.any(forces != forces[0]) == differs


@pytest.mark.parametrize("level", ["gearbox", "specimen"])
@pytest.mark.parametrize("kind", KINDS)
def test_it_belongs_to_the_gearbox_or_to_the_specimen(tones_of, kind, level):
    drawn = tones_of(kind).force
    of_another = tones_of(kind, **{level: 2}).force
    assert np.any(of_another != drawn) == (level == KINDS[kind].level)


def test_a_part_more_at_the_end_changes_no_other(draw):
    parts = list(PARTS.values())
    few, more = draw(*parts[:-1]), draw(*parts)
    assert len(more) == len(few) + 1
    for before, after in zip(few, more, strict=False):
        assert_array_equal(before.force, after.force)
        assert_array_equal(before.base, after.base)


def test_ranges_are_filled_and_kept(tones_of):
    share, slip = {"used_share": [0.2, 0.8]}, {"slip": [0.0, 0.02]}
    drawn = [tones_of("unbalance", share, specimen=k) for k in range(200)]
    result = [abs(tones.force[0, 0]) / 0.5655 for tones in drawn]

    assert 0.2 <= min(result) < 0.23
    assert 0.77 < max(result) <= 0.8001

    cages = [tones_of("bearing", slip, record=k).base[1] for k in range(100)]
    free = bearing_orders(*BEARING, 0.0).cage
    assert free * 0.98 <= min(cages) < max(cages) <= free


@pytest.mark.parametrize("kind", KINDS)
def test_numbers_stay_within_their_limits(kind):
    (part,) = read_nuisances([PARTS[kind]])
    for name, (low, high) in part.limits.items():
        for value in (low - 1, 2 * high):
            with pytest.raises(ConfigError, match=rf"^{name}.* must lie in"):
                replace(part, **{name: value})
    for name, (low, high) in part.ranges.items():
        for ends in ((low - 1, high), (high, low), (low, 2 * high), (low,)):
            with pytest.raises(ConfigError, match=rf"^{name}.* must be two ordered"):
                replace(part, **{name: ends})


@pytest.mark.parametrize("kind", KINDS)
def test_a_limit_of_an_angle_is_within_a_turn(kind):
    (part,) = read_nuisances([PARTS[kind]])
    angles = {each.name for each in fields(part) if each.metadata.get("unit") == "deg"}
    for name in angles & (part.limits.keys() | part.ranges.keys()):
        low, high = (part.limits | part.ranges)[name]
        assert -math.tau <= low < high <= math.tau, name
