"""Flank modifications: shapes, where they begin and end, and what cannot be ground."""

import math

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.mesh.modification import (
    FlankModification,
    PairModification,
    sound_teeth,
)
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

MICRO = 1e-6
MILLI = 1e-3


@pytest.fixture(scope="module")
def pair():
    return PairParts(compose("generate", ["system=helical_pair"])).pair


def of_pair(**sides):
    plain = {
        "pinion": FlankModification(),
        "wheel": FlankModification(),
    }
    return PairModification(**{**plain, **sides})


def at(pair, modification, n_slices=5):
    """Deviation (slice, node) with its positions and places."""
    position = np.linspace(-0.5, 1.5, 401) * pair.path_of_contact
    place = (np.arange(n_slices) + 0.5) * pair.face_width / n_slices
    return (
        position,
        place,
        modification.deviation(pair, position, place),
    )


def test_every_pair_has_its_own_modified_teeth():
    relieved = FlankModification(tip_relief=8 * MICRO, tip_relief_height=0.5 * MILLI)
    modification = of_pair(pinion=relieved)
    for gear in ("xiamen_23_84", "fzg_c_16_24", "xiamen_23_84"):
        pair = PairParts(compose("generate", [f"gear={gear}"])).pair
        teeth = sound_teeth(pair, modification)
        assert {side: tooth.gear for side, tooth in teeth.items()} == pair.gears


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_reliefs_have_their_depth_at_the_ends_and_run_out_over_their_height(
    pair, shape
):
    side = FlankModification(
        tip_relief=8 * MICRO,
        tip_relief_height=0.5 * MILLI,
        root_relief=3 * MICRO,
        root_relief_height=0.4 * MILLI,
        profile_shape=shape,
    )
    position, _, deviation = at(pair, of_pair(pinion=side))
    # the pinion's tip leaves at E, its lowest point enters at A; beyond both the end counts
    assert_close(
        deviation[:, position >= pair.path_of_contact],
        8 * MICRO,
        1e-12,
    )
    assert_close(deviation[:, position <= 0.0], 3 * MICRO, 1e-12)

    radius = np.hypot(pair.pinion.base_radius, pair.pinion_curvature(position))
    begin = (
        radius > pair.pinion.tip_radius - 0.25 * MILLI
    )  # the upper half of the relief
    inside = begin & (position < pair.path_of_contact)
    least = {"linear": 4, "parabolic": 2}[shape]

    assert_close(deviation[0, inside].min(), least * MICRO, 0.15)

    lowest = math.hypot(pair.pinion.base_radius, pair.pinion_curvature(0.0))
    between = (radius < pair.pinion.tip_radius - 0.5 * MILLI) & (
        radius > lowest + 0.4 * MILLI
    )
    assert between.any()
    assert (deviation[:, between] == 0.0).all()


def test_the_wheel_s_tip_enters_where_the_pinion_s_leaves(pair):
    relief = FlankModification(tip_relief=5 * MICRO, tip_relief_height=0.3 * MILLI)
    position, _, deviation = at(pair, of_pair(wheel=relief))
    assert_close(deviation[:, position <= 0.0], 5 * MICRO, 1e-12)
    assert (deviation[:, position >= pair.path_of_contact] == 0.0).all()


def test_crowning_slope_and_end_relief_across_the_face(pair):
    width = pair.face_width
    place = np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * width
    crowned = FlankModification(crowning=4 * MICRO).lead(place, width)

    assert_close(crowned, np.array([4, 1, 0, 1, 4]) * MICRO, atol=1e-18)

    sloped = FlankModification(helix_slope=-4 * MICRO).lead(place, width)
    assert_close(sloped, np.array([0, -1, -2, -3, -4]) * MICRO, atol=1e-18)

    ended = FlankModification(end_relief=6 * MICRO, end_relief_width=0.5 * width).lead(
        place, width
    )
    assert_close(ended, np.array([6, 3, 0, 3, 6]) * MICRO, atol=1e-18)


def test_two_slopes_of_opposite_sign_leave_an_aligned_pair(pair):
    """A slope on one gear is taken back by the other's; nothing ever stands proud."""
    one = FlankModification(helix_slope=5 * MICRO)
    other = FlankModification(helix_slope=-5 * MICRO)
    assert np.abs(at(pair, of_pair(pinion=one, wheel=other))[2]).max() < 1e-18
    assert at(pair, of_pair(pinion=other))[2].min() == 0.0

    askew = PairModification(
        pinion=FlankModification(),
        wheel=other,
        misalignment=5 * MICRO,
    )
    assert np.abs(at(pair, askew)[2]).max() < 1e-18


def test_nothing_is_nothing(pair):
    assert not of_pair().is_any
    assert not of_pair(pinion=FlankModification(profile_shape="parabolic")).is_any
    assert (at(pair, of_pair())[2] == 0.0).all()


@pytest.mark.parametrize("side", ["pinion", "wheel"])
@pytest.mark.parametrize(
    "size",  # reliefs have one of these lengths
    [
        "tip_relief_height",
        "root_relief_height",
        "crowning",
        "end_relief_width",
        "helix_slope",
    ],
)
def test_any_size_of_either_gear_is_a_modification(side, size):
    assert of_pair(**{side: FlankModification(**{size: 1e-9})}).is_any


NO_FLANK = {
    "modification.pinion.tip_relief_um=-1": (
        "modification.pinion.tip_relief_um = -1 must not be negative"
    ),
    "modification.wheel.root_relief_um=1": (
        "modification.wheel.root_relief_height_mm = 0: a relief of 1 um"
    ),
    "modification.wheel.profile_shape=round": (
        "modification.wheel.profile_shape = 'round'; allowed: linear"
    ),
    "+modification.wheel.tip=1": "modification.wheel: unknown key 'tip'",
    "+modification.helix=1": "modification: unknown key 'helix'",
}


@pytest.mark.parametrize(("change", "message"), NO_FLANK.items())
def test_keys_that_make_no_flank_are_refused(change, message):
    with refused(message):
        _ = PairParts(compose("generate", [change])).modification


def test_reliefs_that_overlap_are_refused(pair):
    tall = FlankModification(
        tip_relief=MICRO,
        tip_relief_height=2 * MILLI,
        root_relief=MICRO,
        root_relief_height=2 * MILLI,
    )
    with refused("tip_relief_height_mm = 2 and root_relief_height_mm = 2 overlap"):
        at(pair, of_pair(pinion=tall))
    with refused("at both ends overlaps on a face of 14 mm"):
        at(
            pair,
            of_pair(
                wheel=FlankModification(end_relief=MICRO, end_relief_width=8 * MILLI)
            ),
        )
