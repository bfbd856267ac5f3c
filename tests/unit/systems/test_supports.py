"""What holds a gear: as given, or its bearings and shaft; damping ratios drawn for each gearbox."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dynamics.bearing import support_stiffness
from gensig.dynamics.integrator import settling_time
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record
from gensig.record.streams import Stream, stream
from gensig.sensing.manufacturing import (
    draw_gearbox,
    nominal_gearbox,
    with_damping_ratio,
)
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.registry import read_system
from gensig.systems.run import Run
from gensig.systems.supports import read_holding

BEARINGS = {
    "system.supports": "bearings",
    "quality.support_damping_ratio_low": 0.01,
    "quality.support_damping_ratio_high": 0.1,
}
SIDES = ("pinion", "wheel")
DOCS = Path(__file__).parents[3] / "docs" / "theory" / "supports.md"


def supports(dynamics):
    """Stiffness and damping of pinion x, y and wheel x, y, (support,) each."""
    held = [getattr(dynamics, side).support for side in SIDES]
    stiffness = [value for one in held for value in (one.stiffness_x, one.stiffness_y)]
    return np.array(stiffness), np.array(
        [value for one in held for value in (one.damping_x, one.damping_y)]
    )


def ratios(dynamics):
    """Damping ratios of the gears on their supports, (support,)."""
    stiffness, damping = supports(dynamics)
    return damping / (
        2
        * np.sqrt(stiffness * np.repeat([dynamics.pinion.mass, dynamics.wheel.mass], 2))
    )


@pytest.fixture(scope="module")
def realistic():
    words = [
        "experiment=realistic",
        "plan.n_records=20",
        "plan.n_units=2",
        "plan.n_gearboxes=2",
    ]
    return read_request(words).config


@pytest.fixture(scope="module")
def rows(realistic):
    plan = make_plan(realistic)
    return [plan.record(place) for place in range(20)]


def run_of(config, row):
    return InputReader(config).inputs(row).run


class TestStiffness:
    @pytest.mark.parametrize("torque", [2.0, 20.0])
    def test_it_is_that_of_the_bearings_at_the_set_torque(
        self, machine, config_with, torque
    ):
        system = machine({**BEARINGS, "operating.torque_nm": torque})
        for side in SIDES:
            held = read_holding(getattr(system.pair, side), config_with()["gear"][side])
            expected = support_stiffness(
                held.bearing, held.shaft, system.material, system.mesh_force
            )
            support = getattr(system, side).support
            assert_allclose(
                (support.stiffness_x, support.stiffness_y), expected, rtol=1e-12, atol=0
            )

    def test_a_shaft_without_a_diameter_fills_the_bore(self, machine):
        thin, given = (
            machine(
                {**BEARINGS, "gear.pinion.shaft": {"diameter_mm": value, "span_mm": 80}}
            )
            for value in (None, 18.0)
        )
        assert_allclose(
            thin.pinion.support.stiffness_y,
            given.pinion.support.stiffness_y,
            rtol=1e-12,
            atol=0,
        )

    def test_more_torque_is_stiffer(self, machine):
        low, high = (
            machine({**BEARINGS, "operating.torque_nm": torque})
            for torque in (2.0, 40.0)
        )
        for side in SIDES:
            for key in ("stiffness_x", "stiffness_y"):
                assert getattr(getattr(high, side).support, key) > 1.3 * getattr(
                    getattr(low, side).support, key
                )

    def test_the_table_of_the_docs(self, machine):
        """docs/theory/supports.md prints stiffness in N/um and frequencies in Hz."""
        lines = DOCS.read_text().splitlines()
        rows = [
            line.strip("| ").split(" | ")
            for line in lines
            if " | pinion | " in line or " | wheel | " in line
        ]
        assert len(rows) == 2
        for torque, side, *printed in rows:
            system = machine({**BEARINGS, "operating.torque_nm": float(torque)})
            body = getattr(system, side)
            stiffness = np.array([body.support.stiffness_x, body.support.stiffness_y])
            expected = [
                *(1e-6 * stiffness),
                *(np.sqrt(stiffness / body.mass) / (2 * math.pi)),
            ]
            assert_allclose(
                [float(value) for value in printed[-4:]], expected, rtol=5e-3, atol=0
            )


class TestDamping:
    def test_nominal_is_the_middle_of_the_range(self, machine):
        dynamics = pair_dynamics(Run(system=machine(BEARINGS), faults=()))
        assert_allclose(ratios(dynamics), math.sqrt(0.01 * 0.1), rtol=1e-12, atol=0)

    def test_a_gearbox_has_the_ratios_that_it_drew(self, machine):
        system = machine(BEARINGS)
        box = draw_gearbox(stream(0, Stream.GEARBOX), 4, system.quality, 0.0)
        box = with_damping_ratio(box, stream(0, Stream.SUPPORT), system.quality)
        dynamics = pair_dynamics(Run(system=system, faults=(), gearbox=box))
        nominal, _ = supports(
            pair_dynamics(Run(system=system, faults=(), gearbox=nominal_gearbox(4)))
        )
        assert_allclose(
            supports(dynamics)[0], nominal * box.stiffness_factor, rtol=1e-12, atol=0
        )
        assert_allclose(ratios(dynamics), box.damping_ratio, rtol=1e-12, atol=0)
        assert len(set(box.damping_ratio)) == 4

    def test_ratios_are_log_uniform(self, machine):
        quality = machine(BEARINGS).quality
        drawn = np.array(
            [
                with_damping_ratio(
                    nominal_gearbox(1), stream(0, Stream.SUPPORT, box), quality
                ).damping_ratio
                for box in range(1000)
            ]
        )
        assert drawn.min() >= 0.01
        assert drawn.max() <= 0.1
        assert_allclose(
            np.quantile(drawn, [0.25, 0.5, 0.75]),
            10 ** np.array([-1.75, -1.5, -1.25]),
            rtol=0.05,
            atol=0,
        )

    def test_given_supports_take_a_ratio_too(self, machine):
        ratio = {
            key: value for key, value in BEARINGS.items() if key != "system.supports"
        }
        dynamics = pair_dynamics(Run(system=machine(ratio), faults=()))
        plain, _ = supports(pair_dynamics(Run(system=machine(), faults=())))
        assert_allclose(supports(dynamics)[0], plain, rtol=1e-12, atol=0)
        assert_allclose(ratios(dynamics), math.sqrt(1e-3), rtol=1e-12, atol=0)


def test_as_given_supports_are_those_of_the_option(machine, config_with):
    """Bit for bit: bearing and shaft, there or not, change neither supports nor what a gearbox draws."""
    absent = {
        f"gear.{side}.{key}": None for side in SIDES for key in ("bearing", "shaft")
    }
    plain, without = machine(), machine(absent)
    box = draw_gearbox(stream(0, Stream.GEARBOX), 4, plain.quality, 0.05)
    drawn = with_damping_ratio(box, stream(0, Stream.SUPPORT), plain.quality)
    assert drawn is box
    given = config_with()["gear"]
    for system in (plain, without):
        stiffness, damping = supports(
            pair_dynamics(Run(system=system, faults=(), gearbox=drawn))
        )
        for found, kind, factor in (
            (stiffness, "stiffness_{}_n_per_m", box.stiffness_factor),
            (damping, "damping_{}_ns_per_m", box.damping_factor),
        ):
            expected = np.array(
                [
                    given[side]["support"][kind.format(axis)]
                    for side in SIDES
                    for axis in "xy"
                ]
            )
            assert np.array_equal(found, expected * factor)


class TestRecords:
    def test_all_records_of_a_gearbox_share_their_ratios(self, realistic, rows):
        """Every class and condition; two gearboxes differ."""
        drawn, classes = {}, {}
        for row in rows:
            drawn.setdefault(row["gearbox_id"], []).append(
                run_of(realistic, row).gearbox.damping_ratio
            )
            classes.setdefault(row["gearbox_id"], set()).add(row["label_name"])
        assert len(drawn) == 2
        assert all(
            found == set(realistic["plan"]["classes"]) for found in classes.values()
        )
        assert all(
            np.array_equal(one, found[0]) for found in drawn.values() for one in found
        )
        one, other = (found[0] for found in drawn.values())
        assert not np.any(one == other)

    def test_faults_leave_the_supports_alone(self, realistic, rows):
        by_condition = {}
        for row in rows:
            found = np.concatenate(supports(pair_dynamics(run_of(realistic, row))))
            by_condition.setdefault(row["condition_id"], []).append(found)
        assert len(by_condition) == 4
        for found in by_condition.values():
            assert len(found) == 5
            assert all(np.array_equal(one, found[0]) for one in found)

    def test_a_record_of_the_realistic_machine(self, realistic, rows):
        short = realistic.with_keys("operating", duration_s=0.1)
        row = next(row for row in rows if row["label_name"] == "missing_tooth")
        record = simulate_record(short, row)
        assert record.signals["acceleration"].shape == (3, 5120)
        assert np.isfinite(record.signals["acceleration"]).all()
        assert record.values["integration_check"] == "error"
        assert record.values["integration_error"] < 1e-3

    def test_the_drive_stays_the_slowest_to_settle(self, realistic, rows):
        """Whatever supports a gearbox has, the start is as long as it was with overdamped ones."""
        for row in rows:
            run = run_of(realistic, row)
            drive = (
                2
                * math.pi
                * run.system.operating.drive_frequency
                * run.system.operating.drive_damping_ratio
            )
            assert_allclose(
                settling_time(pair_dynamics(run)),
                math.log(1e4) / drive,
                rtol=1e-3,
                atol=0,
            )


class TestBadInput:
    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            (
                {"system.supports": "springs"},
                "system.supports = 'springs'; allowed: as_given, bearings",
            ),
            (
                {"system.supports": "bearings"},
                "system.supports = bearings says nothing of damping; give quality.",
            ),
            (
                {**BEARINGS, "quality.support_damping_ratio_low": 0.2},
                "quality.support_damping_ratio_low = 0.2 and support_damping_ratio_high = 0.1 must be ordered, above 0",
            ),
            (
                {"quality.support_damping_ratio_low": 0.1},
                "must be ordered, above 0 and at most 1, or both null",
            ),
            (
                {**BEARINGS, "gear.wheel.bearing": None},
                "gear.wheel.bearing = null: system.supports = bearings needs",
            ),
            (
                {**BEARINGS, "gear.pinion.shaft": None},
                "gear.pinion.shaft = null: system.supports = bearings needs",
            ),
            (
                {"gear.pinion.bearing.n_balls": 8.5},
                "gear.pinion.bearing.n_balls = 8.5 is not a whole number",
            ),
            (
                {"gear.pinion.bearing.n_balls": 2},
                "gear.pinion.bearing.n_balls = 2 must lie in 5..60",
            ),
            (
                {"gear.wheel.bearing": 6205},
                "gear.wheel.bearing = 6205 must be a group of keys",
            ),
            (
                {"gear.wheel.shaft": {"span_mm": 80}},
                "gear.wheel.shaft: missing diameter_mm",
            ),
            (
                {"gear.wheel.shaft.span_mm": -1},
                "gear.wheel.shaft.span_mm = -1 must be positive",
            ),
        ],
    )
    def test_one_line(self, config_with, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)) as caught:
            read_system(config_with(changes))
        assert "\n" not in str(caught.value)

    def test_a_ratio_above_1(self, xiamen):
        with pytest.raises(ConfigError, match="at most 1"):
            replace(
                xiamen.quality,
                support_damping_ratio_low=0.5,
                support_damping_ratio_high=1.5,
            )
