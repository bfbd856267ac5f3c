"""Draws of specimens and gearboxes."""

from dataclasses import asdict, replace
from math import tau
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import given, refused

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
    FurtherGear,
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


class EqualDraws:
    """Draws without chance: no runout, teeth that differ, and 1 for every slope."""

    def uniform(self, low, high, size=None):
        return high if size is None else np.full(size, high)

    def random(self):
        return 0.0

    def standard_normal(self, size):
        return np.cos(np.arange(size) ** 2)

    def choice(self, values):
        return max(values)

    def integers(self, low, high):
        return low


def draw(pair, quality, seed=0):
    return draw_specimen(
        rng(seed),
        pair.pinion,
        pair.wheel,
        quality,
    )


def once_per_turn(error):
    """Amplitude of the once-per-turn part, and the tooth, no whole number, that stands back
    most."""
    part = np.fft.rfft(error)[1]
    return 2.0 / len(error) * abs(part), -np.angle(part) * len(error) / (tau)


def eccentric_tilt(gear, error):
    """Growth along the path of the offsets of an eccentric gear, (tooth,) m/m."""
    eccentricity, most = once_per_turn(error)
    angle = tau / gear.n_teeth * (np.arange(gear.n_teeth) - most)
    return -eccentricity / gear.base_radius * np.sin(angle)


def profile_of(pair, specimen, name):
    """Slope of every tooth over the involute, and form of all, by least squares as the standard
    has it."""
    tooth = faulty_teeth(pair, specimen.forms).get((name, 0))
    gear = getattr(pair, name)
    if tooth is None:
        return np.zeros(gear.n_teeth), 0.0
    at, back = tooth.profile.curvature_radius, tooth.flank_deviation[0]
    even = np.linspace(
        at[0],
        at[-1],
        4001,
    )
    trace = np.interp(even, at, back)
    rate, mean = np.polyfit(
        even - even.mean(),
        trace,
        1,
    )
    tilt = getattr(specimen, f"{name}_tilt")
    slope = tilt - eccentric_tilt(gear, getattr(specimen, f"{name}_error"))
    towards_tip = 1.0 if name == "pinion" else -1.0
    slopes = (rate + towards_tip * slope) * (at[-1] - at[0])
    return slopes, np.ptp(trace - mean - rate * (even - even.mean()))


def used(pair, specimen, grade):
    """Shares of the limits f_p, F_p, f_Halpha, f_falpha and F_r, (gear, limit)."""
    shares = []
    for name in GEARS:
        gear = getattr(pair, name)
        error = getattr(specimen, f"{name}_error")
        # offsets are along the line of action
        arc = error / np.cos(gear.pressure_angle)
        slopes, form = profile_of(pair, specimen, name)
        sizes = {
            single_pitch_limit: np.abs(np.diff(arc, append=arc[0])).max(),
            cumulative_pitch_limit: np.ptp(arc),
            profile_slope_limit: np.abs(slopes).max(),
            profile_form_limit: form,
            runout_limit: 2.0 * once_per_turn(error)[0],
        }
        shares.append([size / limit(gear, grade) for limit, size in sizes.items()])
    return np.array(shares)


@pytest.fixture(scope="module")
def pairs(xiamen, gear_with):
    """Pairs of gears from small to large, by name; what is drawn asks for no mesh."""

    def pair(pinion, wheel, **both):
        gears = {
            "pinion": gear_with(**pinion, **both),
            "wheel": gear_with(**wheel, **both, name="wheel"),
        }
        return SimpleNamespace(gears=gears, **gears)

    return {
        "xiamen": xiamen.pair,
        "small": pair({"n_teeth": 18}, {"n_teeth": 25}, normal_module=0.5e-3),
        "large": pair({"n_teeth": 30}, {"n_teeth": 300}, normal_module=20e-3),
        # too few teeth for the runout that the standard allows at this single pitch deviation
        "few": pair({"n_teeth": 10, "profile_shift": 0.45}, {"n_teeth": 60}),
    }


@pytest.mark.parametrize("name", ["xiamen", "small", "large", "few"])
@pytest.mark.parametrize("grade", [1, 5, 6.5, 9, 11])
class TestLimits:
    @pytest.fixture
    def used_by(self, pairs, quality, name, grade):
        """Shares of the limits that specimens use, (seed and gear, limit)."""

        def make(n_seeds, low, high, **changes):
            changed = quality(
                iso1328_grade=grade,
                used_share_low=low,
                used_share_high=high,
                **changes,
            )
            pair = pairs[name]
            specimens = [draw(pair, changed, seed) for seed in range(n_seeds)]
            return np.concatenate([used(pair, each, grade) for each in specimens])

        return make

    def test_every_gear_keeps_to_its_grade(self, used_by):
        assert np.all(used_by(25, 0.8, 1.0, undulation_share=0.3) <= 1.0 + 1e-6)

    @pytest.mark.parametrize("share", [0.3, 0.9])
    def test_it_uses_the_drawn_share(self, used_by, share):
        """Of the single pitch and the profile form to the last digit, of nothing more."""
        shares = used_by(8, share, share)
        assert_allclose(shares[:, 0], share, rtol=1e-9)
        # the trace is read at points
        assert_allclose(shares[:, 3], share, rtol=2e-3)
        assert np.all(shares <= share * (1.0 + 1e-6))


@pytest.fixture
def drawn(xiamen, quality):
    """Specimens of the xiamen pair, one for each seed."""

    def make(n_seeds, **changes):
        changed = quality(**changes)
        return [draw(xiamen.pair, changed, seed) for seed in range(n_seeds)]

    return make


class TestWhatIsDrawn:
    def test_the_used_share_lies_in_its_range(self, xiamen, drawn):
        single_pitch = [used(xiamen.pair, each, 5)[0, 0] for each in drawn(60)]
        assert min(single_pitch) >= 0.3
        assert max(single_pitch) <= 0.9
        assert np.ptp(single_pitch) > 0.4

    def test_running_in_leaves_the_eccentricity_alone(self, xiamen, quality):
        cut, half, worn = (
            draw(xiamen.pair, quality(run_in_share=share)) for share in (0.0, 0.5, 1.0)
        )
        for name in GEARS:
            first, second, last = (
                getattr(specimen, f"{name}_error") for specimen in (cut, half, worn)
            )
            assert_allclose(second, 0.5 * (first + last), atol=1e-12)
            amplitude = once_per_turn(first)[0]
            assert_allclose(once_per_turn(last)[0], amplitude, rtol=1e-9)
            # nothing but the circle is left
            assert_allclose(last.std(), amplitude / np.sqrt(2.0), atol=1e-12)
        assert [len(specimen.forms) > 0 for specimen in (cut, worn)] == [True, False]
        slopes = [specimen.forms[0].profile_slope for specimen in (cut, half)]
        assert_allclose(slopes[1], 0.5 * slopes[0])

    def test_tilts_without_slopes_are_those_of_an_eccentric_circle(self, xiamen, drawn):
        """Eccentricity is in the once-per-turn part of the offsets, once; they have no mean."""
        for specimen in drawn(10, tooth_share=0.0):
            for name in GEARS:
                error = getattr(specimen, f"{name}_error")
                tilt = getattr(specimen, f"{name}_tilt")
                expected = eccentric_tilt(getattr(xiamen.pair, name), error)
                assert_allclose(
                    tilt,
                    expected,
                    atol=1e-9 * np.abs(tilt).max(),
                )
                assert_allclose(error.mean(), 0.0, atol=1e-15)

    def test_eccentricities_phases_and_signs_scatter(self, xiamen, drawn):
        specimens = drawn(80)
        waves = [once_per_turn(each.wheel_error) for each in specimens]
        size, most = np.transpose(waves)

        assert size.min() < 1.0 * UM
        assert 5.0 * UM < size.max() <= 0.5 * 0.9 * runout_limit(xiamen.pair.wheel, 5)
        assert len(np.unique(np.floor(most % 84 / 21))) == 4

        is_positive = [each.forms[0].profile_slope > 0.0 for each in specimens]
        assert 25 <= np.sum(is_positive) <= 55

    def test_teeth_differ_by_their_share_of_the_slope(self, xiamen, drawn):
        half = {"used_share_low": 0.5, "used_share_high": 0.5}
        specimen = drawn(6, **half, tooth_share=0.4)[-1]
        slopes, _ = profile_of(xiamen.pair, specimen, "wheel")
        limit = 0.5 * profile_slope_limit(xiamen.pair.wheel, 5)

        assert_allclose(
            np.abs(slopes).max(),
            limit,
            rtol=0.03,
        )
        assert_allclose(
            np.ptp(slopes),
            2 * 0.4 * limit,
            rtol=0.1,
        )

    @pytest.mark.parametrize("name", GEARS)
    def test_a_slope_of_a_tooth_is_drawn_towards_its_own_tip(
        self, xiamen, quality, name
    ):
        """Drawn as 1 for every tooth it is the common slope of sign 1, on either gear."""
        pair = xiamen.pair
        of_teeth, common = (
            draw_specimen(
                EqualDraws(),
                pair.pinion,
                pair.wheel,
                quality(tooth_share=share, undulation_share=1.0),
            )
            for share in (1.0, 0.0)
        )
        tooth = faulty_teeth(pair, common.forms)[(name, 0)]
        at, back = tooth.profile.curvature_radius, tooth.flank_deviation[0]
        even = np.linspace(at[0], at[-1], 4001)
        towards_tip = np.polyfit(even, np.interp(even, at, back), 1)[0]
        # by how much the contact moves towards the tip as it runs along the path
        begin, end = pair.curvature(name, np.array([0.0, pair.base_pitch]))
        run = (end - begin) / pair.base_pitch

        assert towards_tip > 0.0
        tilt = getattr(of_teeth, f"{name}_tilt")
        assert_allclose(tilt, towards_tip * run, rtol=1e-3)

    @pytest.mark.parametrize(
        "share",
        [0.0, 0.25, 1.0],
    )
    def test_undulation_is_part_of_the_form(self, drawn, share):
        (specimen,) = drawn(1, undulation_share=share, undulation_waves=11)
        forms = [form for form in specimen.forms if form.gear == "pinion"]
        heights = np.array([form.profile_form for form in forms])
        is_wave = np.array([form.profile_waves == 11 for form in forms])
        part = heights[is_wave].sum() / heights.sum()

        assert_allclose(part, share, atol=1e-15)

    def test_misalignment_and_backlash_keep_to_their_range(self, drawn):
        specimens = drawn(60, misalignment=8 * UM, backlash_scatter=0.3)
        mountings = [each.forms[-1] for each in specimens]
        assert {type(form) for form in mountings} == {Misalignment}

        tilts = [form.misalignment / (8 * UM) for form in mountings]
        backlash = [(each.backlash_factor - 1.0) / 0.3 for each in specimens]
        for values in (tilts, backlash):
            assert 0.85 < np.abs(values).max() <= 1.0 + 1e-9
            assert min(values) < 0.0 < max(values)

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
    def test_one_key_leaves_the_rest_alone(self, drawn, changes):
        (default,), (other,) = drawn(1), drawn(1, **changes)
        assert_array_equal(default.pinion_error, other.pinion_error)
        assert_array_equal(default.wheel_error, other.wheel_error)
        assert repr(default) != repr(other)

    def test_no_grade_is_perfect(self, xiamen, drawn):
        scatter = {"misalignment": 9 * UM, "backlash_scatter": 0.9}
        words = {"iso1328_grade": None, "undulation_share": 0.5, **scatter}
        (specimen,) = drawn(1, **words)
        perfect = perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel)

        assert repr(specimen) == repr(perfect)
        assert specimen.backlash_factor == 1.0
        values = asdict(specimen)
        del values["backlash_factor"]
        assert not any(np.any(value) for value in values.values())

    def test_a_gear_outside_the_standard_needs_no_grade(self, machine):
        tiny = {
            "gear.normal_module_mm": 0.4,
            "gear.pinion.bore_radius_mm": 1.5,
            "gear.wheel.bore_radius_mm": 5,
        }
        with refused("module, the pinion has 0.4"):
            machine(tiny).check()
        machine({**tiny, "quality.iso1328_grade": None}).check()


class TestFurtherGears:
    """Gears outside the followed mesh are drawn after it."""

    def drawn(self, pair, quality, others=(), n_mountings=0):
        return draw_specimen(
            rng(3),
            pair.pinion,
            pair.wheel,
            quality,
            others=others,
            n_mountings=n_mountings,
        )

    def others(self, pair):
        return tuple(
            FurtherGear(gear=replace(pair.pinion, name=name), drives=drives)
            for name, drives in (("sun", True), ("planet", False))
        )

    def test_they_leave_pinion_and_wheel_alone(self, xiamen, quality):
        pair, grade = xiamen.pair, quality(misalignment=5 * UM, backlash_scatter=0.5)
        alone = self.drawn(pair, grade)
        more = self.drawn(pair, grade, self.others(pair), 2)
        assert repr(replace(more, others={}, mountings=())) == repr(alone)
        assert list(more.others) == ["sun", "planet"]

    def test_each_has_errors_of_its_own(self, xiamen, quality):
        pair, grade = xiamen.pair, quality(misalignment=5 * UM, backlash_scatter=0.5)
        more = self.drawn(pair, grade, self.others(pair), 2)
        sun, planet = more.others.values()
        assert {form.gear for form in sun.forms} == {"sun"}
        assert abs(np.corrcoef(sun.error, planet.error)[0, 1]) < 0.9
        first, second = more.mountings
        assert first.backlash_factor != second.backlash_factor
        assert first.misalignment != second.misalignment
        (form,) = first.forms("pinion")
        assert (form.gear, form.misalignment) == ("pinion", first.misalignment)

    def test_the_mountings_do_not_move_the_gears(self, xiamen, quality):
        """One mesh more draws after all that was there."""
        pair, grade = xiamen.pair, quality()
        one, two = (self.drawn(pair, grade, self.others(pair), n) for n in (1, 2))
        assert repr(replace(two, mountings=two.mountings[:1])) == repr(one)

    def test_perfect_gears_have_none(self, xiamen, quality):
        pair = xiamen.pair
        none = self.drawn(pair, quality(iso1328_grade=None), self.others(pair), 2)
        assert (none.others, none.mountings) == ({}, ())
        assert not np.any(none.errors_of("sun", 7).error)
        assert not np.any(none.errors_of("sun", 7).tilt)
        assert none.mounting(1).forms("pinion") == ()

    def test_a_tooth_slope_turns_with_the_flank_that_touches(self, xiamen, quality):
        """Contact runs to the tip of a driving gear, away from that of a driven one."""
        pair, grade = xiamen.pair, quality(tooth_share=1.0)
        tilts = {}
        for drives in (True, False):
            gear = FurtherGear(gear=replace(pair.pinion, name="sun"), drives=drives)
            tilts[drives] = self.drawn(pair, grade, (gear,)).others["sun"].tilt
        flat = replace(grade, profile_errors=False)
        (round_only,) = self.drawn(pair, flat, self.others(pair)[:1]).others.values()
        assert_allclose(tilts[True] + tilts[False], 2.0 * round_only.tilt, atol=1e-15)
        assert np.abs(tilts[True] - tilts[False]).max() > 1e-6


def test_supports_of_further_gears_are_drawn_after_the_first(quality):
    scattered = quality(support_stiffness_scatter=0.2, support_damping_scatter=0.1)
    two = draw_gearbox(rng(1), 4, scattered, 0.05)
    four = draw_gearbox(rng(1), 4, scattered, 0.05, n_gears=4)
    for key in ("stiffness_factor", "damping_factor"):
        assert_array_equal(getattr(four, key)[:4], getattr(two, key))
        assert len(set(getattr(four, key))) == 8
    assert_array_equal(four.gain, two.gain)


def test_gearbox_factors_scatter_as_the_quality_says(quality):
    scatters = {"stiffness_factor": 0.2, "damping_factor": 0.1, "gain": 0.05}
    scattered = quality(support_stiffness_scatter=0.2, support_damping_scatter=0.1)
    gearboxes = [draw_gearbox(rng(seed), 4, scattered, 0.05) for seed in range(400)]
    for key, scatter in scatters.items():
        logarithm = np.log([getattr(gearbox, key) for gearbox in gearboxes])
        assert_allclose(logarithm.std(), scatter, rtol=0.06)
        assert_allclose(logarithm.mean(), 0.0, atol=0.1 * scatter)


OUT_OF_RANGE = {
    "iso1328_grade=12": "iso1328_grade = 12 must lie in 1..11, or be null",
    "run_in_share=1.5": "run_in_share = 1.5 must lie in 0..1",
    "used_share_low=0.95": "used_share_low and used_share_high must be ordered",
    "support_damping_scatter=-0.1": "support_damping_scatter = -0.1 must lie in 0..1",
    "tooth_share=1.1": "tooth_share = 1.1 must lie in 0..1",
    "undulation_waves=0": "undulation_waves = 0 must lie in 1..50",
    "misalignment=-3e-6": "misalignment_um = -3 must not be negative",
}


@pytest.mark.parametrize(("change", "text"), OUT_OF_RANGE.items())
def test_values_out_of_range(quality, change, text):
    with refused(text):
        quality(**given(change))
