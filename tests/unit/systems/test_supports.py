"""Supports of gears: as given, or by bearings and shaft; damping ratios drawn for each gearbox."""

import math
from collections import Counter, defaultdict
from dataclasses import replace
from math import tau
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from closeness import assert_close
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.dynamics.bearing import support_stiffness
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
from gensig.systems.pair_machine import running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run
from gensig.systems.supports import DAMPING_RATIO, in_gearbox, read_holding

LOW, HIGH = "quality.support_damping_ratio_low", "quality.support_damping_ratio_high"
RATIOS = {LOW: 0.01, HIGH: 0.1}
BEARINGS = {"system.supports": "bearings", **RATIOS}
TORQUE = "operating.torque_nm"
SIDES = ("pinion", "wheel")
WHEEL = "gear.wheel"
FORMATS = ("stiffness_{}_n_per_m", "damping_{}_ns_per_m")
HELICAL = {"system.kind": "helical_pair"}
NULLS = {
    f"gear.{side}.support.{name.format(axis)}": None
    for side in SIDES
    for name in FORMATS
    for axis in "xy"
}
DOCS = Path(__file__).parents[3] / "docs" / "theory" / "supports.md"


def stiffness_of(side):
    return np.array([side.support.stiffness_x, side.support.stiffness_y])


def damping_of(side):
    return np.array([side.support.damping_x, side.support.damping_y])


def supports(run):
    """Stiffness and damping of pinion x, y and wheel x, y, (support,), and damping ratios."""
    running = running_pair(run)
    sides = running.pinion, running.wheel
    stiffness = np.concatenate([stiffness_of(side) for side in sides])
    damping = np.concatenate([damping_of(side) for side in sides])
    mass = np.repeat(
        [side.mass for side in sides],
        2,
    )
    return stiffness, damping, damping / (2 * np.sqrt(stiffness * mass))


class TestStiffness:
    @pytest.mark.parametrize("torque", [2.0, 20.0])
    def test_it_is_that_of_the_bearings_at_the_set_torque(
        self, machine, config_with, torque
    ):
        system = machine({**BEARINGS, TORQUE: torque})
        softer = machine({**BEARINGS, TORQUE: 0.05 * torque})
        for side in SIDES:
            gear = config_with()["gear"][side]
            held = read_holding(getattr(system.pair, side), gear)
            force = system.material, system.mesh_force
            expected = support_stiffness(held.bearing, held.shaft, *force)
            stiffness = stiffness_of(getattr(system, side))
            assert_close(stiffness, expected, 1e-12)
            assert np.all(stiffness > 1.3 * stiffness_of(getattr(softer, side)))

    def test_a_shaft_without_a_diameter_fills_the_bore(self, machine):
        shafts = [{"diameter_mm": value, "span_mm": 80} for value in (None, 18.0)]
        systems = [
            machine({**BEARINGS, "gear.pinion.shaft": shaft}) for shaft in shafts
        ]
        filling, given = (stiffness_of(system.pinion) for system in systems)
        assert_close(filling, given, 1e-12)

    def test_the_table_of_the_docs(self, machine):
        """docs/theory/supports.md prints stiffness in N/um and frequencies in Hz."""
        lines = [
            line.strip("| ").split(" | ") for line in DOCS.read_text().splitlines()
        ]
        rows = [line for line in lines if len(line) > 5 and line[1] in SIDES]
        assert len(rows) == 2
        for torque, side, *printed in rows:
            body = getattr(
                machine({**BEARINGS, TORQUE: float(torque)}),
                side,
            )
            stiffness = stiffness_of(body)
            frequency = np.sqrt(stiffness / body.mass) / (tau)
            values = [float(value) for value in printed[-4:]]
            assert_close(
                values,
                [*(1e-6 * stiffness), *frequency],
                5e-3,
            )


class TestDamping:
    @pytest.mark.parametrize(
        "keys",
        [BEARINGS, RATIOS],
        ids=["bearings", "as_given"],
    )
    def test_nominal_is_the_middle_of_the_range(self, machine, keys):
        stiffness, _, ratio = supports_of(machine(keys))
        assert_close(ratio, math.sqrt(0.01 * 0.1), 1e-12)
        if keys is RATIOS:
            assert_close(stiffness, supports_of(machine())[0], 1e-12)

    def test_a_gearbox_has_the_ratios_that_it_drew(self, machine):
        system = machine(BEARINGS)
        box = draw_gearbox(
            stream(0, Stream.GEARBOX),
            4,
            system.quality,
            0.0,
        )
        box = with_damping_ratio(
            box,
            stream(0, Stream.SUPPORT),
            system.quality,
        )
        stiffness, _, ratio = supports_of(system, box)
        nominal = supports_of(system, nominal_gearbox(4))[0]

        assert_close(stiffness, nominal * box.stiffness_factor, 1e-12)
        assert_close(ratio, box.damping_ratio, 1e-12)
        assert len(set(box.damping_ratio)) == 4

    def test_ratios_are_log_uniform(self, machine):
        quality, box = machine(BEARINGS).quality, nominal_gearbox(1)
        streams = [stream(0, Stream.SUPPORT, number) for number in range(1000)]
        boxes = [with_damping_ratio(box, rng, quality) for rng in streams]
        drawn = np.array([each.damping_ratio for each in boxes])

        assert 0.01 <= drawn.min() < drawn.max() <= 0.1

        quarters = np.quantile(
            np.log10(drawn),
            [0.25, 0.5, 0.75],
        )
        assert_close(
            quarters,
            [-1.75, -1.5, -1.25],
            atol=0.02,
        )


@pytest.mark.parametrize(
    "changes", [{"system.supports": "bearings"}, HELICAL | NULLS, NULLS]
)
def test_nothing_of_a_support_need_be_given(machine, changes):
    """At the rated torque both ways are the same, and damping is that of 0.03."""
    stiffness, _, ratio = supports_of(machine(changes))
    assert_close(stiffness, supports_of(machine(BEARINGS))[0], 1e-12)
    assert_close(ratio, DAMPING_RATIO, 1e-12)


def test_what_is_given_of_a_support_stays(machine):
    key = f"{WHEEL}.support.stiffness_x_n_per_m"
    system = machine(NULLS | {key: 5e7})
    derived = machine(BEARINGS).wheel.support.stiffness_y
    assert system.wheel.support.stiffness_x == 5e7
    assert_close(system.wheel.support.stiffness_y, derived, 1e-12)
    # c = 2 zeta sqrt(k m) of the stiffness that it has
    damping = 2.0 * DAMPING_RATIO * math.sqrt(5e7 * system.wheel.mass)
    assert_close(system.wheel.support.damping_x, damping, 1e-12)


def test_supports_that_are_null_are_those_of_the_rated_torque(machine):
    doubled = machine(NULLS | {"operating.torque_nm": 40})
    assert doubled.wheel.support == machine(NULLS).wheel.support
    on_bearings = machine(BEARINGS | {"operating.torque_nm": 40})
    assert on_bearings.wheel.support.stiffness_y > doubled.wheel.support.stiffness_y


def supports_of(system, gearbox=None):
    return supports(Run(system=system, faults=(), gearbox=gearbox))


def test_as_given_supports_are_those_of_the_option(machine, config_with):
    """To the bit: bearings and shafts change neither supports nor the draws of a gearbox."""
    keys = [f"gear.{side}.{key}" for side in SIDES for key in ("bearing", "shaft")]
    plain, gears = machine(), config_with()["gear"]
    box = draw_gearbox(
        stream(0, Stream.GEARBOX),
        4,
        plain.quality,
        0.05,
    )

    assert with_damping_ratio(box, stream(0, Stream.SUPPORT), plain.quality) is box

    factors = box.stiffness_factor, box.damping_factor
    for system in (plain, machine(dict.fromkeys(keys))):
        held = supports_of(system, box)
        for values, key, factor in zip(held, FORMATS, factors, strict=False):
            names = [key.format(axis) for axis in "xy"]
            given = [gears[side]["support"][name] for side in SIDES for name in names]
            assert_array_equal(values, np.array(given) * factor)


class TestRecords:
    @pytest.fixture(scope="class")
    @classmethod
    def realistic(cls):
        words = ["plan.n_records=20", "plan.n_units=2", "plan.n_gearboxes=2"]
        return read_request(["experiment=realistic", *words]).config

    @pytest.fixture(scope="class")
    @classmethod
    def runs(cls, realistic):
        """Rows of the plan and their runs."""
        plan, reader = make_plan(realistic), InputReader(realistic)
        rows = [plan.record(index) for index in range(20)]
        return [(row, reader.inputs(row).run) for row in rows]

    def test_records_share_the_supports_of_their_gearbox(self, realistic, runs):
        """In every class and condition; two gearboxes differ."""
        ratios, classes, conditions = (defaultdict(set) for _ in range(3))
        n_records = Counter(row["condition_id"] for row, _ in runs)
        for row, run in runs:
            box, condition = row["gearbox_id"], row["condition_id"]
            ratios[box].add(tuple(run.gearbox.damping_ratio))
            classes[box].add(row["label_name"])
            conditions[condition].add(np.concatenate(supports(run)).tobytes())
        (first,), (second,) = ratios.values()

        assert not set(first) & set(second)
        assert list(classes.values()) == [set(realistic["plan"]["classes"])] * 2
        assert list(n_records.values()) == [5] * 4
        assert [len(held) for held in conditions.values()] == [1] * 4

    def test_a_record_of_the_realistic_machine(self, realistic, runs):
        short = realistic.with_keys("operating", duration_s=0.1)
        row = next(row for row, _ in runs if row["label_name"] == "missing_tooth")
        record = simulate_record(InputReader(short), row)

        assert record.signals["acceleration"].shape == (3, 5120)
        assert np.isfinite(record.signals["acceleration"]).all()
        assert record.values["integration_check"] == "error"
        assert record.values["integration_error"] < 1e-3

    def test_the_drive_stays_the_slowest_to_settle(self, runs):
        for _, run in runs:
            operating = run.system.operating
            decay = operating.drive_frequency * operating.drive_damping_ratio
            expected = math.log(1e4) / (tau * decay)
            assert_close(running_pair(run).dynamics.settling_time, expected, 1e-3)


def test_axial_and_tilt_supports_are_as_given_where_they_are(config_with):
    given = {
        "stiffness_z_n_per_m": 2e7,
        "damping_z_ns_per_m": 300.0,
        "stiffness_tilt_nm_per_rad": 4e4,
        "damping_tilt_nms_per_rad": 5.0,
    }
    keys = {f"{WHEEL}.support.{key}": value for key, value in given.items()}
    changes = {"system.kind": "helical_pair", **keys}
    held = read_system(config_with(changes)).wheel.support
    found = held.stiffness_z, held.damping_z, held.stiffness_tilt, held.damping_tilt
    assert found == tuple(given.values())


REFUSED = [
    ({"system.kind": "belt"}, "system.kind = 'belt'; allowed: spur_pair, helical_pair"),
    ({f"{WHEEL}.mass_kg": 0}, f"{WHEEL}.mass_kg = 0 must be positive, or null"),
    ({"gear.backlash_um": True}, "gear.backlash_um = True is not a number"),
    (
        {
            **HELICAL,
            **{f"{WHEEL}.support.stiffness_{axis}_n_per_m": 0 for axis in "xy"},
        },
        f"{WHEEL}.support: a helical pair needs a radial stiffness above 0",
    ),
    (
        {**HELICAL, f"{WHEEL}.shaft": None},
        "stiffness_tilt_nm_per_rad = null is derived from shaft.span_mm",
    ),
    ({"system.supports": "springs"}, "'springs'; allowed: as_given, bearings"),
    (
        {**BEARINGS, LOW: 0.2},
        f"{LOW} = 0.2 and support_damping_ratio_high = 0.1 must be",
    ),
    ({LOW: 0.1}, "must be ordered, above 0 and at most 1, or both null"),
    ({LOW: 0.5, HIGH: 1.5}, "at most 1"),
    (
        {**BEARINGS, f"{WHEEL}.bearing": None},
        f"{WHEEL}.bearing = null: system.supports",
    ),
    ({**BEARINGS, f"{WHEEL}.shaft": None}, f"{WHEEL}.shaft = null: system.supports"),
    ({f"{WHEEL}.bearing.n_balls": 8.5}, "n_balls = 8.5 is not a whole number"),
    ({f"{WHEEL}.bearing.n_balls": 2}, f"{WHEEL}.bearing.n_balls = 2 must lie in 5..60"),
    ({f"{WHEEL}.bearing": 6205}, f"{WHEEL}.bearing = 6205 must be a group of keys"),
    ({f"{WHEEL}.shaft": {"span_mm": 80}}, f"{WHEEL}.shaft: missing diameter_mm"),
    ({f"{WHEEL}.shaft.span_mm": -1}, f"{WHEEL}.shaft.span_mm = -1 must be positive"),
]


@pytest.mark.parametrize(("changes", "text"), REFUSED)
def test_refusals(config_with, changes, text):
    with refused(text):
        read_system(config_with(changes))


def test_axial_and_tilt_supports_scatter_by_the_mean_of_both_radial_ones(xiamen):
    held = replace(
        xiamen.pinion.support,
        stiffness_z=1e8,
        damping_z=100.0,
        stiffness_tilt=4e4,
        damping_tilt=0.5,
    )
    gearbox = SimpleNamespace(
        stiffness_factor=np.array([1.0, 1.0, 2.0, 8.0]),
        damping_factor=np.array([1.0, 1.0, 0.5, 0.125]),
        damping_ratio=None,
    )
    drawn = in_gearbox(
        replace(xiamen.pinion, support=held),
        gearbox,
        slice(2, 4),
        SimpleNamespace(support_damping_ratio=None),
    ).support

    factors = {"stiffness_x": 2.0, "stiffness_y": 8.0, "damping_x": 0.5}
    factors |= {"damping_y": 0.125, "stiffness_z": 4.0, "stiffness_tilt": 4.0}
    factors |= {"damping_z": 0.25, "damping_tilt": 0.25}
    for name, factor in factors.items():
        assert_allclose(
            getattr(drawn, name), factor * getattr(held, name), err_msg=name
        )
