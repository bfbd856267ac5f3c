"""The group ``operating``: courses as configurations give them, users' files, and mistakes."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.operation.courses import MOST_POINTS, Profile
from gensig.operation.options import read_operating, read_profile
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.systems.lead_in import earlier
from gensig.systems.registry import read_system
from gensig.systems.run import Run

SPEED, TORQUE = "operating.speed_profile", "operating.torque_profile"
SPEED_RIPPLE, TORQUE_RIPPLE = "operating.speed_ripple", "operating.torque_ripple"
WALK = {"kind": "random_walk", "scatter": 0.01, "correlation_time_s": 0.1}
RAMP = {"kind": "ramp", "first_factor": 0.5, "last_factor": 1.0}
COURSES = ("speed_profile", "torque_profile", "speed_ripple", "torque_ripple")
TIMES = np.array([-3.0, -0.4012, 0.0013, 0.3117, 0.9012, 1.9])


@pytest.fixture(scope="module")
def operating(config_with):
    return lambda changes: read_operating(config_with(changes)["operating"])


def saved(folder, text):
    file = folder / "course.csv"
    file.write_text(text)
    return {"kind": "file", "file": str(file)}


class TestKinds:
    def test_walks_of_speed_and_torque_are_different(self, operating):
        both = operating({SPEED: WALK, TORQUE: WALK})
        factors = [both.speed_profile.factors, both.torque_profile.factors]
        assert abs(np.corrcoef(factors)[0, 1]) < 0.5
        assert operating({SPEED: WALK}).speed_profile == both.speed_profile

        other = operating({SPEED: WALK, "operating.course_seed": 1})
        assert other.speed_profile != both.speed_profile

    def test_the_options_compose(self):
        constant, ramp, drifting = (
            read_system(read_request(words).config).operating
            for words in ([], ["operating=ramp"], ["operating=drifting"])
        )
        assert constant.is_steady
        assert ramp.speed_profile == Profile(times=(0.0, 4.0), factors=(0.5, 1.0))
        assert ramp.torque_profile is None
        assert not drifting.is_steady
        assert None not in [getattr(drifting, name) for name in COURSES]

    def test_typed_profiles_compose(self):
        words = [f"{SPEED}=[[0,0.5],[1,1]]", f"{TORQUE}=[[0.1,0],[0.2,1.5],[1,1]]"]
        result = read_system(read_request(words).config).operating
        assert result.speed_profile == Profile(times=(0.0, 1.0), factors=(0.5, 1.0))

        torque = Profile(
            times=(0.1, 0.2, 1.0),
            factors=(0.0, 1.5, 1.0),
        )
        assert result.torque_profile == torque

    def test_a_drawn_speed_scales_the_profile(self, config_with):
        reader = InputReader(config_with({SPEED: [[0, 0.5], [1, 1]]}))
        for speed in (600.0, 1200.0):
            result = reader.machine({"operating.speed_rpm": speed}).operating
            nominal = result.nominal(np.array([-0.3, 0.5, 2.0]))
            set_speed = speed * math.pi / 30
            expected = set_speed * np.array([0.5, 0.75, 1.0])
            assert_allclose(nominal.speed, expected)

    @pytest.mark.parametrize("speed", [600.0, 1800.0])
    @pytest.mark.parametrize(
        ("key", "text", "expected"),
        [
            (SPEED, "factor,time_s\n0.5,-1\n0.5,0\n1,1\n", [0.5, 0.5, 0.75, 1.0]),
            (SPEED, "time_s,speed_rpm\n0,900\n1,1500\n", [900, 900, 1200, 1500]),
            (TORQUE, "time_s,torque_nm\n0,10\n1,40\n", [10, 10, 25, 40]),
        ],
        ids=["factors", "speeds", "torques"],
    )
    def test_files_of_factors_speeds_and_torques(
        self, operating, tmp_path, key, text, expected, speed
    ):
        set_speed = {"operating.speed_rpm": speed}
        result = operating({key: saved(tmp_path, text), **set_speed})
        nominal = result.nominal(np.array([-1.0, 0.0, 0.5, 1.0]))
        values = {
            "factor": nominal.speed / result.speed,
            "speed_rpm": nominal.speed * 30 / math.pi,
            "torque_nm": nominal.torque_factor * result.torque,
        }
        (name,) = values.keys() & set(text.split("\n")[0].split(","))

        assert_allclose(values[name], expected)

    def test_a_file_may_end_one_step_early(self, operating, tmp_path):
        rows = "".join(f"{k / 100},1\n" for k in range(100))
        course = saved(tmp_path, "time_s,factor\n" + rows)
        assert operating({SPEED: course}).speed_profile is not None

    def test_as_many_points_as_allowed(self):
        points = [[k * 1e-3, 1.0] for k in range(MOST_POINTS)]
        assert len(read_profile(SPEED, points).times) == MOST_POINTS


def check_refused(config, start, text):
    with refused(text) as caught:
        read_system(config)
    assert str(caught.value).startswith(start)


PROFILES = [
    (3, " = 3 is no list; give [time_s, factor] pairs, a group with a kind"),
    ({"a": 1}, ".kind = None; allowed: ramp, random_walk, file"),
    ([[0, 1]], ": 1 points; give 2 to 100000"),
    ([[k, 1] for k in range(100_001)], ": 100001 points; give 2 to 100000"),
    ([0, 1], ": point 0 = 0; give two finite numbers, [time_s, factor]"),
    ([[0, 1], [1, 1, 1]], ": point 1 = [1, 1, 1]; give two finite numbers"),
    ([[0, True], [1, 1]], ": point 0 = [0, True]; give two finite numbers"),
    ([[0, math.nan], [1, 1]], ": point 0 = [0, nan]; give two finite numbers"),
    ([[0, 1], [1, 10**400]], ": point 1 = [1, 1000"),
    ([[0, 1], [2e6, 1]], ": point 1 = [2e+06, 1]; give a time within 1e+06 s"),
    ([[0, 1], [1, 1], [0.5, 1]], ": the time 0.5 s follows 1 s; times must increase"),
    ([[0, 1], [1e-5, 1]], "times must increase, by 0.001 s or more"),
    ([[0, 1], [1, -0.5]], ": factor -0.5 must "),
    ({**RAMP, "slope": 1}, ": unknown key 'slope'; known: first_factor, last_factor"),
    ({**RAMP, "end_s": 0}, ": the time 0 s follows 0 s; times must increase"),
    ({**WALK, "scatter": 1}, ": scatter = 1 must lie in 0..0.2"),
    ({"kind": "file", "file": 3}, ": kind = file needs exactly file"),
    ({"kind": "file", "file": "none.csv"}, ".file = none.csv cannot be read: No such"),
]
RIPPLES = [
    (3, " = 3 must be a group of keys, not one value"),
    ({"share": 0.1}, ": give order (of the pinion's turn) or frequency_hz"),
    ({"share": "x", "order": 1}, ".share = 'x' is not a number"),
    ({"share": 0.1, "frequency_hz": 151}, ": frequency_hz = 151 Hz, above 150 Hz"),
    ({"share": 0.1, "order": 6}, ": order 6 makes up to 180 Hz, above 150 Hz"),
]
FILES = {
    "time_s,rpm 0,1 1,1": "no column speed_rpm or factor; it must have time_s and one",
    "time_s,speed_rpm,factor 0,1,1 1,1,1": "unknown column factor; it must have time_s",
    "t,factor 0,1 1,1": "no column time_s; it must have time_s, factor",
    "time_s,factor 0,1 1,nan": "row 3, column factor is no finite number",
    "time_s,factor 0,1 2,1 1,1": "the time 1 s follows 2 s; times must increase",
    "time_s,factor 0,1 0.2,1 0.4,1": "runs from 0 s to 0.4 s, the record from 0 to 1 s",
    "time_s,factor 0.1,1 2,1": "too short: it runs from 0.1 s to 2 s, the record",
    "time_s,speed_rpm 0,100 1,0": "operating.speed_profile: factor 0 must be positive",
}


class TestRefusals:
    @pytest.mark.parametrize(("value", "text"), PROFILES)
    @pytest.mark.parametrize("key", [SPEED, TORQUE])
    def test_of_profiles(self, config_with, key, value, text):
        check_refused(config_with({key: value}), key, text)

    @pytest.mark.parametrize("table", FILES)
    def test_of_files(self, config_with, tmp_path, table):
        course = saved(
            tmp_path,
            table.replace(" ", "\n") + "\n",
        )
        check_refused(
            config_with({SPEED: course}),
            SPEED,
            FILES[table],
        )

    @pytest.mark.parametrize(("value", "text"), RIPPLES)
    @pytest.mark.parametrize("key", [SPEED_RIPPLE, TORQUE_RIPPLE])
    def test_of_ripples(self, config_with, key, value, text):
        check_refused(config_with({key: value}), key, f"{key}{text}")

    def test_an_order_is_judged_at_the_fastest(self, operating):
        ripple = {SPEED_RIPPLE: {"share": 0.1, "order": 4}}
        assert operating(ripple).speed_ripple.order == 4
        with refused("order 4 makes up to 180 Hz"):
            operating({**ripple, SPEED: [[0, 1], [1, 1.5]]})

    @pytest.mark.parametrize(
        ("key", "value", "text"),
        [
            ("turns", 0, " = 0 must be positive, or null to use duration_s"),
            ("turns", "ten", " = 'ten' is not a number"),
            ("turns_of", "gear", " = 'gear'; allowed: pinion, wheel, faulted"),
            ("course_seed", -1, " = -1 must not be negative"),
        ],
    )
    def test_of_turns_and_seeds(self, config_with, key, value, text):
        key = f"operating.{key}"
        check_refused(config_with({key: value}), key, f"{key}{text}")


class TestRipple:
    @pytest.mark.parametrize(
        "rate",
        [{"order": 1}, {"frequency_hz": 30}],
    )
    def test_of_a_constant_speed(self, operating, rate):
        ripple = {"share": 0.1, "phase_deg": 90, **rate}
        result = operating({SPEED_RIPPLE: ripple})
        nominal = result.nominal(np.array([0.0, 0.25, 0.5]) / 30)
        share = nominal.speed / result.speed

        assert_allclose(share, [1.1, 1.0, 0.9])
        assert_array_equal(nominal.torque_factor, 1.0)

    @pytest.mark.parametrize(
        "ripple",
        [{"share": 0.1, "order": 2}, {"share": 0.2, "frequency_hz": 9}],
    )
    def test_speed_and_slopes_are_derivatives(self, operating, ripple):
        rippled = {
            SPEED_RIPPLE: ripple,
            TORQUE_RIPPLE: {**ripple, "phase_deg": 30},
        }
        result = operating({SPEED: WALK, TORQUE: RAMP, **rippled})
        times, h = np.array([-0.2512, 0.1013, 0.5017, 0.9123]), 1e-6
        before, at, after = (result.nominal(times + shift) for shift in (-h, 0.0, h))

        assert result.nominal(np.zeros(1)).angle == 0.0
        for slope, name in (
            ("speed", "angle"),
            ("acceleration", "speed"),
            ("torque_slope", "torque_factor"),
        ):
            expected = (getattr(after, name) - getattr(before, name)) / (2 * h)
            assert_allclose(
                getattr(at, slope),
                expected,
                rtol=1e-5,
                atol=1e-5,
            )

    def test_the_order_follows_the_set_angle_of_both_shafts_courses(self, operating):
        """On a ramp a torque ripple of order 2 has two periods a turn of the pinion, whatever the
        speed."""
        result = operating({SPEED: RAMP, TORQUE_RIPPLE: {"share": 0.1, "order": 2}})
        nominal = result.nominal(np.linspace(0.0, 1.0, 2001))
        expected = 1 + 0.1 * np.sin(2 * nominal.angle)
        assert_allclose(nominal.torque_factor, expected, atol=1e-9)


@pytest.mark.parametrize(
    "ripple",
    [{"share": 0.02, "order": 2}, {"share": 0.02, "frequency_hz": 50, "phase_deg": 20}],
)
def test_a_lead_in_shifts_all_courses_alike(machine, ripple):
    courses = {
        SPEED: WALK,
        TORQUE: WALK,
        SPEED_RIPPLE: ripple,
        TORQUE_RIPPLE: ripple,
    }
    filtered = {"sensing.sensor.low_cutoff_hz": 2.0}
    run = Run(
        system=machine(courses | filtered),
        faults=(),
    )
    lead = run.system.sensing.n_lead / run.system.sensing.sampling_rate

    assert lead > 0.05

    longer = earlier(run).system.operating
    there, here = longer.nominal(TIMES + lead), run.system.operating.nominal(TIMES)
    for name in ("speed", "acceleration", "torque_factor", "torque_slope"):
        assert_allclose(
            getattr(there, name),
            getattr(here, name),
            atol=1e-6,
        )

    at_begin = longer.nominal(np.array([lead])).angle
    assert_allclose(there.angle - at_begin, here.angle, atol=1e-8)
