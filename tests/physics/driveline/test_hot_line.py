"""Hot drive lines: every mesh has the effects that heat has on a pair like it."""

import math

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.errors import GeometryError
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.systems.hot_pair import Duty, as_configured, hot_state
from gensig.systems.registry import PairParts

SHORT = ("operating.duration_s=0.02", "mesh.points_per_pitch=64", "mesh.n_slices=6")
BOXES = ("two_stage_gearbox", "phm09_helical_two_stage")
HOT = "heat=chongqing_rated"


def config_of(*words):
    return read_request([*SHORT, *words]).config


def line(*words):
    return read_machine(config_of(*words))


def duty_of(cold, heat):
    """The followed mesh of a cold line as a pair at work."""
    return Duty(system=cold.flanks, heat=heat, speed=cold.operating.speed)


@pytest.mark.parametrize("box", BOXES)
def test_the_followed_mesh_is_as_hot_as_a_pair(box):
    cold, hot = line(f"system={box}"), line(f"system={box}", HOT)
    duty = duty_of(cold, PairParts(config_of(HOT)).heat)
    growth = hot.heat[hot.mesh_number].growth
    expected = hot_state(duty).growth
    assert_close(growth.pinion.tooth, expected.pinion.tooth, 1e-12)
    assert_close(growth.wheel.body, expected.wheel.body, 1e-12)

    pair = as_configured(duty)
    assert_close(
        hot.heat[hot.mesh_number].material.youngs_modulus,
        pair.material.youngs_modulus,
        1e-12,
    )
    # the line keeps the size of the drawing: ratios are those of the grown pair
    assert_close(
        hot.pair.transverse_contact_ratio, pair.pair.transverse_contact_ratio, 1e-6
    )
    assert not math.isclose(
        hot.pair.transverse_contact_ratio,
        cold.pair.transverse_contact_ratio,
        rel_tol=1e-6,
    )
    assert_close(hot.pair.backlash, pair.pair.backlash, 1e-3)


def test_every_mesh_has_the_temperatures_of_its_own_friction():
    whole = line("system=two_stage_gearbox", HOT)
    second = line("system=two_stage_gearbox", HOT, "system.record_mesh=[5,6]")
    assert second.mesh_number != whole.mesh_number
    for number in range(2):
        ours, theirs = whole.heat[number].growth, second.heat[number].growth
        assert_close(ours.pinion.tooth, theirs.pinion.tooth, 1e-9)
        assert_close(ours.wheel.tooth, theirs.wheel.tooth, 1e-9)
    first, last = (effects.growth.wheel.tooth for effects in whole.heat)
    assert abs(first - last) > 1e-7


@pytest.mark.parametrize("box", BOXES)
def test_hot_flanks_deviate_by_their_growth(box):
    words = ("heat.pinion_temperature_degc=95", "heat.wheel_temperature_degc=60")
    cold, hot = line(f"system={box}"), line(f"system={box}", HOT, *words)
    growth = hot.heat[hot.mesh_number].growth
    ours, drawn = hot.mesh_table(), cold.mesh_table()
    if ours.is_separable:
        share = ours.position / hot.pair.path_of_contact
        on_path = (share > 0.02) & (share < 0.98)  # flanks of whole teeth end in edges
        opened = ours.pairs.gap[0, 0, 0] - drawn.pairs.gap[0, 0, 0]
        deviation = growth.deviation(hot.pair, ours.position)
        assert np.ptp(deviation[on_path]) > 1e-6
        assert_close(opened[on_path], deviation[on_path], atol=3e-8)
    else:
        shift = hot.flanks.deviation() - growth.deviation(
            hot.pair, np.array(ours.position)
        )
        assert_close(shift, 0.0, atol=1e-12)


@pytest.mark.parametrize("box", BOXES)
def test_a_line_at_the_temperature_of_its_drawing_is_cold(box):
    at_rest = [
        f"heat.{part}_temperature_degc=20" for part in ("pinion", "wheel", "housing")
    ]
    cold, hot = line(f"system={box}"), line(f"system={box}", HOT, *at_rest)
    expected = cold.simulate().acceleration
    scale = np.abs(expected).max()
    assert_close(hot.simulate().acceleration, expected, atol=1e-6 * scale)


def test_a_gearbox_that_jams_names_the_mesh():
    with refused("mesh 3/4: the gears jam", GeometryError):
        line(
            "system=two_stage_gearbox",
            HOT,
            "heat.pinion_temperature_degc=150",
            "heat.wheel_temperature_degc=150",
            "heat.housing_temperature_degc=-50",
        )


def test_faster_lines_are_hotter():
    slow = line("system=two_stage_gearbox", HOT)
    fast = line("system=two_stage_gearbox", HOT, "operating.speed_rpm=3000")
    speed = slow.operating.speed / slow.ratio
    assert fast.operating.speed / fast.ratio > speed
    growths = [machine.heat[0].growth.pinion.tooth for machine in (slow, fast)]
    assert growths[1] > growths[0]
