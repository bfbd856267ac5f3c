"""The engine paper's printed response, and an independent estimate of it, against ours."""

import numpy as np
import pytest
from engine_cases import (
    DAMPER_STATES,
    IN_SEQUENCE,
    RPM,
    engine_line,
    option,
    response_of,
    with_throws,
)
from numpy.testing import assert_allclose
from validation.checks.engine_response_checks import read_forced_case

FLYWHEEL, CRANK_GEAR, PUMP_GEAR, FAR_END = 13, 2, 44, 64
BASE_RADIUS = 0.081 * np.cos(
    np.radians(20.0)
)  # both gears of the pump drive: 54 teeth, module 3 mm, table 2


def test_the_table_reader_and_plain_arrays_give_the_same_response():
    """The tests' own line, from the table's torsional stiffnesses, against the one that the
    program builds.
    """
    case = read_forced_case(("system=engine_gear_train", "excitation=engine_v20"))
    own = response_of(option())
    assert_allclose(case.response.fluctuation(), own.fluctuation(), rtol=1e-6)
    _, elements, ends = engine_line()
    mean, _ = own.element_forces(elements)
    drive = ends.index((21, 45))
    assert_allclose(
        case.response.element_forces(case.meshes)[0][case.mesh_names.index("21/45")],
        mean[drive] / BASE_RADIUS,
        rtol=1e-6,
    )


@pytest.mark.parametrize("damper", list(DAMPER_STATES))
def test_flywheel_is_in_the_range_of_an_independent_estimate(damper):
    """13.4 to 17.9 r/min at the flywheel, over damper states and firing orders."""
    result = (
        response_of(
            with_throws(option(injection_pump=None), IN_SEQUENCE), damper
        ).fluctuation()
        / RPM
    )
    assert 13.4 <= result[FLYWHEEL] <= 17.9


def test_firing_orders_span_the_estimate_at_every_place():
    """Crank gear 46 to 54 and pump end 28 r/min from the engine alone: near the middle of what
    firing orders do.
    """
    alone, rng, result = option(injection_pump=None), np.random.default_rng(0), []
    for _ in range(24):
        order = (1, *(int(one) for one in rng.permutation(np.arange(2, 11))))
        result.append(response_of(with_throws(alone, order)).fluctuation() / RPM)
    low, middle, high = np.percentile(result, [10, 50, 90], axis=0)
    for place, first, last in (
        (FLYWHEEL, 13.4, 17.9),
        (CRANK_GEAR, 46.0, 54.0),
        (FAR_END, 28.0, 28.0),
    ):
        assert low[place] < first
        assert last < high[place]
        assert first * 0.85 < middle[place] < last * 1.15


def test_order_1_dominates_at_the_flywheel_near_the_first_mode():
    result = response_of(with_throws(option(), IN_SEQUENCE))
    lines = np.abs(result.speed_deviation[FLYWHEEL])
    assert result.orders[np.argmax(lines)] == 1.0
    speeds = np.arange(1640.0, 1781.0, 20.0)
    at_order_1 = [
        np.abs(
            response_of(
                with_throws(option(), IN_SEQUENCE), speed=rpm * RPM
            ).speed_deviation[FLYWHEEL, 1]
        )
        for rpm in speeds
    ]
    # 28.3 Hz at order 1 is 1699 r/min; with 7 % of damping the speed's peak lies above it,
    # inside the range run
    assert 1690.0 <= speeds[np.argmax(at_order_1)] <= 1750.0


def test_plungers_move_the_pump_end_and_not_the_flywheel():
    with_pump, without = (
        response_of(values).fluctuation()
        for values in (option(), option(injection_pump=None))
    )
    assert with_pump[PUMP_GEAR] > 2.0 * without[PUMP_GEAR]
    assert with_pump[FAR_END] > 10.0 * without[FAR_END]
    assert abs(with_pump[FLYWHEEL] / without[FLYWHEEL] - 1.0) < 0.05
