"""The group ``operating``: kinds of courses as configurations give them, users' files, and what is
refused."""

import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.operation.courses import Profile
from gensig.operation.options import read_operating
from gensig.plan.request import read_request
from gensig.systems.lead_in import earlier
from gensig.systems.registry import read_system
from gensig.systems.run import Run

SPEED, TORQUE = "operating.speed_profile", "operating.torque_profile"
WALK = {"kind": "random_walk", "scatter": 0.01, "correlation_time_s": 0.1}
RAMP = {"kind": "ramp", "first_factor": 0.5, "last_factor": 1.0}
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
        found = operating({SPEED: WALK, TORQUE: WALK})
        one, other = (
            np.array(course.factors)
            for course in (found.speed_profile, found.torque_profile)
        )
        assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
        assert operating({SPEED: WALK, TORQUE: WALK}) == found
        assert (
            operating({SPEED: WALK, "operating.course_seed": 1}).speed_profile
            != found.speed_profile
        )
        assert operating({SPEED: WALK}).speed_profile == found.speed_profile

    def test_the_options_compose(self):
        ramp, drifting = (
            read_request([f"operating={name}"]).config for name in ("ramp", "drifting")
        )
        found = read_system(ramp).operating
        assert found.speed_profile == Profile(times=(0.0, 4.0), factors=(0.5, 1.0))
        assert found.torque_profile is None
        found = read_system(drifting).operating
        assert None not in (
            found.speed_profile,
            found.torque_profile,
            found.speed_ripple,
            found.torque_ripple,
        )
        assert not found.is_steady
        assert read_system(read_request([]).config).operating.is_steady

    def test_a_file_of_factors(self, operating, tmp_path):
        own = saved(tmp_path, "factor,time_s\n0.5,-1\n0.5,0\n1,1\n")
        for speed in (600.0, 1800.0):
            found = operating({SPEED: own, "operating.speed_rpm": speed})
            assert_allclose(
                found.nominal(TIMES[:2]).speed / found.speed, 0.5, rtol=1e-12, atol=0
            )

    def test_a_file_of_speeds_and_one_of_torques(self, operating, tmp_path):
        own = saved(tmp_path, "time_s,speed_rpm\n0,900\n1,1500\n")
        for speed in (600.0, 1800.0):
            found = operating({SPEED: own, "operating.speed_rpm": speed}).nominal(
                np.array([-1.0, 0.5, 1.0])
            )
            assert_allclose(
                found.speed,
                np.array([900, 1200, 1500]) * math.pi / 30,
                rtol=1e-12,
                atol=0,
            )
        own = saved(tmp_path, "time_s,torque_nm\n0,10\n1,40\n")
        found = operating({TORQUE: own})
        assert_allclose(
            found.torque * found.nominal(np.array([0.5])).torque_factor,
            25,
            rtol=1e-12,
            atol=0,
        )

    def test_a_file_may_end_one_step_early(self, operating, tmp_path):
        rows = "".join(f"{k / 100},1\n" for k in range(100))
        assert (
            operating({SPEED: saved(tmp_path, "time_s,factor\n" + rows)}).speed_profile
            is not None
        )


def read_refused(config, start, text):
    with pytest.raises(ConfigError, match=re.escape(text)) as caught:
        read_system(config)
    assert str(caught.value).startswith(start)
    assert "\n" not in str(caught.value)


class TestRefusals:
    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (
                {**RAMP, "slope": 1},
                ": unknown key 'slope'; known: first_factor, last_factor",
            ),
            ({**RAMP, "end_s": 0}, ": the time 0 s follows 0 s; times must increase"),
            ({**RAMP, "last_factor": -1}, ": factor -1 must "),
            ({**RAMP, "last_factor": "x"}, ".last_factor = 'x' is not a number"),
            ({**WALK, "scatter": 1}, ": scatter = 1 must lie in 0..0.2"),
            ({"kind": "file", "file": 3}, ": kind = file needs exactly file"),
            (
                {"kind": "file", "file": "none.csv"},
                ".file = none.csv cannot be read: No such file",
            ),
        ],
    )
    @pytest.mark.parametrize("key", [SPEED, TORQUE])
    def test_of_profiles(self, config_with, key, value, text):
        read_refused(config_with({key: value}), key, f"{key}{text}")

    @pytest.mark.parametrize(
        ("table", "text"),
        [
            (
                "time_s,rpm 0,1 1,1",
                "no column speed_rpm or factor; it must have time_s and one",
            ),
            (
                "time_s,speed_rpm,factor 0,1,1 1,1,1",
                "unknown column factor; it must have time_s",
            ),
            ("t,factor 0,1 1,1", "no column time_s; it must have time_s, factor"),
            ("time_s,factor 0,1 1,nan", "row 3, column factor is no finite number"),
            (
                "time_s,factor 0,1 2,1 1,1",
                "the time 1 s follows 2 s; times must increase",
            ),
            (
                "time_s,factor 0,1 0.2,1 0.4,1",
                "runs from 0 s to 0.4 s, the record from 0 to 1 s",
            ),
            (
                "time_s,factor 0.1,1 2,1",
                "too short: it runs from 0.1 s to 2 s, the record",
            ),
            (
                "time_s,speed_rpm 0,100 1,0",
                "operating.speed_profile: factor 0 must be positive",
            ),
        ],
    )
    def test_of_files(self, config_with, tmp_path, table, text):
        course = saved(tmp_path, table.replace(" ", "\n") + "\n")
        read_refused(config_with({SPEED: course}), SPEED, text)

    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (3, " = 3 must be a group of keys, not one value"),
            ({"share": 0.1}, ": give order (of the pinion's turn) or frequency_hz"),
            ({"share": "x", "order": 1}, ".share = 'x' is not a number"),
            (
                {"share": 0.1, "frequency_hz": 151},
                ": frequency_hz = 151 Hz, above 150 Hz",
            ),
            ({"share": 0.1, "order": 6}, ": order 6 makes up to 180 Hz, above 150 Hz"),
        ],
    )
    @pytest.mark.parametrize(
        "key", [f"operating.{side}_ripple" for side in ("speed", "torque")]
    )
    def test_of_ripples(self, config_with, key, value, text):
        read_refused(config_with({key: value}), key, f"{key}{text}")

    def test_an_order_is_judged_at_the_fastest(self, operating):
        ripple = {"share": 0.1, "order": 4}
        assert operating({"operating.speed_ripple": ripple}).speed_ripple.order == 4
        with pytest.raises(ConfigError, match="order 4 makes up to 180 Hz"):
            operating({"operating.speed_ripple": ripple, SPEED: [[0, 1], [1, 1.5]]})

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
        read_refused(config_with({key: value}), key, f"{key}{text}")


class TestRipple:
    def test_of_a_constant_speed(self, operating):
        found = operating(
            {"operating.speed_ripple": {"share": 0.1, "order": 1, "phase_deg": 90}}
        )
        nominal = found.nominal(np.array([0.0, 0.25, 0.5]) / 30)
        assert_allclose(
            nominal.speed / found.speed, [1.1, 1.0, 0.9], rtol=1e-12, atol=0
        )
        assert_allclose(nominal.torque_factor, 1.0, rtol=0, atol=0)

    @pytest.mark.parametrize(
        "ripple", [{"share": 0.1, "order": 2}, {"share": 0.2, "frequency_hz": 9}]
    )
    def test_speed_and_slopes_are_derivatives(self, operating, ripple):
        found = operating(
            {
                SPEED: WALK,
                TORQUE: RAMP,
                "operating.speed_ripple": ripple,
                "operating.torque_ripple": {**ripple, "phase_deg": 30},
            }
        )
        times, h = np.array([-0.2512, 0.1013, 0.5017, 0.9123]), 1e-6
        before, at, after = (found.nominal(times + shift) for shift in (-h, 0.0, h))
        assert_allclose(
            at.speed, (after.angle - before.angle) / (2 * h), rtol=1e-7, atol=0
        )
        assert_allclose(
            at.acceleration,
            (after.speed - before.speed) / (2 * h),
            rtol=1e-5,
            atol=1e-4,
        )
        assert_allclose(
            at.torque_slope,
            (after.torque_factor - before.torque_factor) / (2 * h),
            rtol=1e-5,
            atol=1e-5,
        )

    def test_the_order_follows_the_set_angle_of_both_shafts_courses(self, operating):
        """On a ramp a torque ripple of order 2 has two periods a turn of the pinion, whatever the
        speed."""
        found = operating(
            {SPEED: RAMP, "operating.torque_ripple": {"share": 0.1, "order": 2}}
        )
        times = np.linspace(0.0, 1.0, 2001)
        nominal = found.nominal(times)
        assert_allclose(
            nominal.torque_factor,
            1 + 0.1 * np.sin(2 * nominal.angle),
            rtol=0,
            atol=1e-9,
        )


@pytest.mark.parametrize(
    "ripple",
    [{"share": 0.02, "order": 2}, {"share": 0.02, "frequency_hz": 50, "phase_deg": 20}],
)
def test_a_lead_in_shifts_all_courses_alike(machine, ripple):
    changes = {
        SPEED: WALK,
        TORQUE: WALK,
        "operating.speed_ripple": ripple,
        "operating.torque_ripple": ripple,
        "sensing.sensor.low_cutoff_hz": 2.0,
    }
    run = Run(system=machine(changes), faults=())
    lead = run.system.sensing.n_lead / run.system.sensing.sampling_rate
    assert lead > 0.05
    longer, own = earlier(run).system.operating, run.system.operating
    there, here = longer.nominal(TIMES + lead), own.nominal(TIMES)
    for name in ("speed", "acceleration", "torque_factor", "torque_slope"):
        assert_allclose(getattr(there, name), getattr(here, name), rtol=1e-8, atol=1e-6)
    at_begin = longer.nominal(np.array([lead])).angle
    assert_allclose(there.angle - at_begin, here.angle, rtol=1e-9, atol=1e-8)
