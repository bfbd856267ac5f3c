"""Draws of specimens and gearboxes."""

import re
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.faults.base import faulty_teeth
from gensig.faults.flank_form import Misalignment
from gensig.sensing.gear_tolerances import (
    cumulative_pitch_limit,
    profile_form_limit,
    profile_slope_limit,
    runout_limit,
    single_pitch_limit,
)
from gensig.sensing.manufacturing import (
    draw_gearbox,
    draw_specimen,
    perfect_specimen,
)

UM = 1e-6
GEARS = ("pinion", "wheel")


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def quality(xiamen):
    """The default quality with keys replaced."""
    return lambda **changes: replace(xiamen.quality, **changes)


def draw(pair, quality, seed=0):
    return draw_specimen(rng(seed), pair.pinion, pair.wheel, quality)


def largest_step(error):
    return np.abs(np.diff(np.append(error, error[0]))).max()


def once_per_turn(error):
    """Amplitude of the once-per-turn part, and the tooth, no whole number, that stands back
    most."""
    part = np.fft.rfft(error)[1]
    return 2.0 / len(error) * abs(part), -np.angle(part) * len(error) / (2.0 * np.pi)


def eccentric_tilt(gear, error):
    """Growth along the path of the offsets of an eccentric gear, (tooth,) m/m."""
    eccentricity, most = once_per_turn(error)
    return (
        -eccentricity
        / gear.base_radius
        * np.sin(2.0 * np.pi / gear.n_teeth * (np.arange(gear.n_teeth) - most))
    )


def profile_of(pair, specimen, name):
    """Slope of every tooth over the involute, and form of all, by least squares as the standard
    has it."""
    tooth = faulty_teeth(pair, specimen.forms).get((name, 0))
    gear = getattr(pair, name)
    if tooth is None:
        return np.zeros(gear.n_teeth), 0.0
    at, back = tooth.profile.curvature_radius, tooth.flank_deviation[0]
    even = np.linspace(at[0], at[-1], 4001)
    trace = np.interp(even, at, back)
    rate, mean = np.polyfit(even - even.mean(), trace, 1)
    own = getattr(specimen, f"{name}_tilt") - eccentric_tilt(
        gear, getattr(specimen, f"{name}_error")
    )
    towards_tip = 1.0 if name == "pinion" else -1.0
    slopes = (rate + towards_tip * own) * (at[-1] - at[0])
    return slopes, np.ptp(trace - mean - rate * (even - even.mean()))


def used(pair, specimen, grade):
    """Share of every limit that a gear uses, by gear: f_p, F_p, f_Halpha, f_falpha, F_r."""
    shares = {}
    for name in GEARS:
        gear = getattr(pair, name)
        error = getattr(specimen, f"{name}_error")
        arc = error / np.cos(
            gear.pressure_angle
        )  # offsets are along the line of action
        slopes, form = profile_of(pair, specimen, name)
        shares[name] = np.array(
            [
                largest_step(arc) / single_pitch_limit(gear, grade),
                np.ptp(arc) / cumulative_pitch_limit(gear, grade),
                np.abs(slopes).max() / profile_slope_limit(gear, grade),
                form / profile_form_limit(gear, grade),
                2.0 * once_per_turn(error)[0] / runout_limit(gear, grade),
            ]
        )
    return shares


@pytest.fixture(scope="module")
def pairs(xiamen, gear_with):
    """Pairs of gears from small to large, by name; what is drawn asks for no mesh."""

    def pair(pinion, wheel):
        gears = {
            "pinion": gear_with(**pinion),
            "wheel": replace(gear_with(**wheel), name="wheel"),
        }
        return SimpleNamespace(gears=gears, **gears)

    small, large = {"normal_module": 0.5e-3}, {"normal_module": 20e-3}
    return {
        "xiamen": xiamen.pair,
        "small": pair({"n_teeth": 18, **small}, {"n_teeth": 25, **small}),
        "large": pair({"n_teeth": 30, **large}, {"n_teeth": 300, **large}),
        # too few teeth for the runout that the standard allows at this single pitch deviation
        "few": pair({"n_teeth": 10, "profile_shift": 0.45}, {"n_teeth": 60}),
    }


@pytest.mark.parametrize("name", ["xiamen", "small", "large", "few"])
@pytest.mark.parametrize("grade", [1, 5, 6.5, 9, 11])
class TestLimits:
    def test_every_gear_keeps_to_its_grade(self, pairs, quality, name, grade):
        own = quality(
            iso1328_grade=grade,
            used_share_low=0.8,
            used_share_high=1.0,
            undulation_share=0.3,
        )
        for seed in range(25):
            for shares in used(
                pairs[name], draw(pairs[name], own, seed), grade
            ).values():
                assert (shares <= 1.0 + 1e-6).all(), (seed, shares)

    @pytest.mark.parametrize("share", [0.3, 0.9])
    def test_it_uses_the_drawn_share(self, pairs, quality, name, grade, share):
        """Of the single pitch and the profile form to the last digit, of nothing more."""
        own = quality(iso1328_grade=grade, used_share_low=share, used_share_high=share)
        for seed in range(8):
            for shares in used(
                pairs[name], draw(pairs[name], own, seed), grade
            ).values():
                assert_allclose(shares[0], share, rtol=1e-9, atol=0)
                assert_allclose(
                    shares[3], share, rtol=2e-3, atol=0
                )  # the trace is read at points
                assert (shares <= share * (1.0 + 1e-6)).all()


class TestWhatIsDrawn:
    def test_limits_broken_are_seen(self, xiamen, quality):
        """The check of the limits can fail: gears of grade 7 are not of grade 5."""
        specimen = draw(xiamen.pair, quality(iso1328_grade=7, used_share_low=0.9))
        for shares in used(xiamen.pair, specimen, 5).values():
            assert (shares > 1.0).sum() >= 2

    def test_the_used_share_lies_in_its_range(self, xiamen, quality):
        found = [
            used(xiamen.pair, draw(xiamen.pair, quality(), seed), 5)["pinion"][0]
            for seed in range(60)
        ]
        assert min(found) >= 0.3
        assert max(found) <= 0.9
        assert np.ptp(found) > 0.4

    def test_everything_doubles_in_two_grades(self, xiamen, quality):
        fine, coarse = (
            draw(xiamen.pair, quality(iso1328_grade=grade), 3) for grade in (5, 7)
        )
        for key in ("pinion_error", "wheel_error", "pinion_tilt", "wheel_tilt"):
            assert_allclose(
                getattr(coarse, key), 2 * getattr(fine, key), rtol=1e-9, atol=1e-20
            )
        for one, other in zip(fine.forms, coarse.forms, strict=True):
            assert_allclose(
                other.profile_slope, 2 * one.profile_slope, rtol=1e-12, atol=0
            )
            assert_allclose(
                other.profile_form, 2 * one.profile_form, rtol=1e-12, atol=0
            )

    def test_errors_have_no_mean(self, xiamen, quality):
        for seed in range(10):
            specimen = draw(xiamen.pair, quality(), seed)
            for name in GEARS:
                assert_allclose(
                    getattr(specimen, f"{name}_error").mean(), 0.0, rtol=0, atol=1e-15
                )

    def test_eccentricity_is_the_only_once_per_turn_part(self, xiamen, quality):
        """Without the tooth-to-tooth slopes the tilts are those of an eccentric circle: it is
        there once, not twice."""
        for seed in range(10):
            specimen = draw(xiamen.pair, quality(tooth_share=0.0), seed)
            for name in GEARS:
                gear, error = (
                    getattr(xiamen.pair, name),
                    getattr(specimen, f"{name}_error"),
                )
                tilt = getattr(specimen, f"{name}_tilt")
                assert_allclose(
                    tilt,
                    eccentric_tilt(gear, error),
                    rtol=0,
                    atol=1e-9 * np.abs(tilt).max(),
                )

    def test_eccentricities_and_phases_scatter(self, xiamen, quality):
        drawn = [
            once_per_turn(draw(xiamen.pair, quality(), seed).wheel_error)
            for seed in range(80)
        ]
        size, most = np.array(drawn).T
        assert size.min() < 1.0 * UM
        assert 5.0 * UM < size.max() <= 0.5 * 0.9 * runout_limit(xiamen.pair.wheel, 5)
        assert len(np.unique(np.floor(most % 84 / 21))) == 4

    def test_slopes_of_either_sign(self, xiamen, quality):
        slopes = [
            draw(xiamen.pair, quality(), seed).forms[0].profile_slope
            for seed in range(40)
        ]
        assert 10 <= np.sum(np.array(slopes) > 0.0) <= 30

    def test_teeth_differ_by_their_share_of_the_slope(self, xiamen, quality):
        own = quality(used_share_low=0.5, used_share_high=0.5, tooth_share=0.4)
        slopes, _ = profile_of(xiamen.pair, draw(xiamen.pair, own, 5), "wheel")
        limit = profile_slope_limit(xiamen.pair.wheel, 5)
        assert_allclose(np.abs(slopes).max(), 0.5 * limit, rtol=0.03, atol=0)
        assert_allclose(np.ptp(slopes), 2 * 0.4 * 0.5 * limit, rtol=0.1, atol=0)

    def test_undulation_is_part_of_the_form(self, xiamen, quality):
        for part in (0.0, 0.25, 1.0):
            forms = draw(
                xiamen.pair, quality(undulation_share=part, undulation_waves=11), 2
            ).forms
            own = [form for form in forms if form.gear == "pinion"]
            waves = sum(form.profile_form for form in own if form.profile_waves == 11)
            assert_allclose(
                waves / sum(form.profile_form for form in own),
                part,
                rtol=1e-12,
                atol=1e-15,
            )

    def test_misalignment_and_backlash_keep_to_their_range(self, xiamen, quality):
        own = quality(misalignment=8 * UM, backlash_scatter=0.3)
        specimens = [draw(xiamen.pair, own, seed) for seed in range(60)]
        tilted = np.array([one.forms[-1].misalignment for one in specimens])
        assert all(isinstance(one.forms[-1], Misalignment) for one in specimens)
        for values, reach in (
            (tilted, 8 * UM),
            (np.array([one.backlash_factor - 1 for one in specimens]), 0.3),
        ):
            assert 0.85 * reach < np.abs(values).max() <= reach
            assert values.min() < 0.0 < values.max()

    @pytest.mark.parametrize(
        "changes",
        [
            {"profile_errors": False},
            {"tooth_share": 0.0},
            {"undulation_share": 0.5},
            {"misalignment": 5 * UM},
            {"backlash_scatter": 0.0},
        ],
    )
    def test_one_key_leaves_the_rest_alone(self, xiamen, quality, changes):
        one, other = (
            draw(xiamen.pair, quality(), 7),
            draw(xiamen.pair, quality(**changes), 7),
        )
        for key in ("pinion_error", "wheel_error"):
            assert_allclose(getattr(one, key), getattr(other, key), rtol=0, atol=0)
        assert any(
            repr(getattr(one, field.name)) != repr(getattr(other, field.name))
            for field in fields(one)
        )

    def test_no_grade_is_perfect(self, xiamen, quality):
        nothing = quality(
            iso1328_grade=None,
            misalignment=9 * UM,
            backlash_scatter=0.9,
            undulation_share=0.5,
        )
        specimen, perfect = (
            draw(xiamen.pair, nothing),
            perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel),
        )
        for field in fields(perfect):
            assert_allclose(
                getattr(specimen, field.name),
                getattr(perfect, field.name),
                rtol=0,
                atol=0,
            )
        assert not any(
            np.any(getattr(specimen, field.name)) for field in fields(perfect)[:-1]
        )
        assert specimen.backlash_factor == 1.0

    def test_a_gear_outside_the_standard_needs_no_grade(self, machine):
        tiny = {
            "gear.normal_module_mm": 0.4,
            "gear.pinion.bore_radius_mm": 1.5,
            "gear.wheel.bore_radius_mm": 5,
        }
        with pytest.raises(
            ConfigError, match=r"covers 0\.5 to 70 mm module, the pinion has 0\.4"
        ):
            machine(tiny).check()
        machine({**tiny, "quality.iso1328_grade": None}).check()


def test_gearbox_factors_scatter_as_told(xiamen):
    quality = replace(
        xiamen.quality, support_stiffness_scatter=0.2, support_damping_scatter=0.1
    )
    drawn = [draw_gearbox(rng(seed), 4, quality, 0.05) for seed in range(400)]
    for key, scatter in (
        ("stiffness_factor", 0.2),
        ("damping_factor", 0.1),
        ("gain", 0.05),
    ):
        logarithm = np.log([getattr(gearbox, key) for gearbox in drawn])
        assert_allclose(logarithm.std(), scatter, rtol=0.06, atol=0)
        assert_allclose(logarithm.mean(), 0.0, rtol=0, atol=0.1 * scatter)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"iso1328_grade": 12}, "iso1328_grade = 12 must lie in 1..11, or be null"),
        (
            {"used_share_low": 0.95},
            "used_share_low and used_share_high must be ordered",
        ),
        (
            {"support_damping_scatter": -0.1},
            "support_damping_scatter = -0.1 must lie in 0..1",
        ),
        ({"tooth_share": 1.1}, "tooth_share = 1.1 must lie in 0..1"),
        ({"undulation_waves": 0}, "undulation_waves = 0 must lie in 1..50"),
        ({"misalignment": -3e-6}, "misalignment_um = -3 must not be negative"),
    ],
)
def test_values_out_of_range(xiamen, changes, text):
    with pytest.raises(ConfigError, match=re.escape(text)):
        replace(xiamen.quality, **changes)
