"""Hot pairs: effects of heat on mesh stiffness, and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import side_of
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.errors import ConfigError, ExtrapolationError, GeometryError
from gensig.geometry.contact import SIDES
from gensig.mesh.modification import FlankModification
from gensig.mesh.thermal.body_heat import heat_capacity, time_constant
from gensig.mesh.thermal.paper_growth import READINGS
from gensig.options.compose import compose
from gensig.systems.hot_pair import (
    as_configured,
    compared,
    flash_skin_growth,
    heated,
    hot_state,
    stiffness_variants,
    sweep,
)
from gensig.systems.registry import PairParts, read_sliced_pair, read_system

MESH = [
    "system=helical_pair",
    "gear=chongqing_40_162",
    "mesh.law=paper",
    "mesh.pair_coupling=sum",
    "mesh.contact=linear",
    "mesh.slice_coupling=independent",
    "mesh.allow_extrapolation=true",
    "mesh.n_slices=20",
]
FRICTION = "mesh.friction_coefficient"
UNCOOLED = ["heat.face_convection_w_per_m2k=0", "heat.tooth_convection_w_per_m2k=0"]


def at(pinion, wheel=None, housing=None):
    """Words for temperatures of the gears in degrees, and of the housing."""
    sides = {
        "pinion": pinion,
        "wheel": wheel or pinion,
        "housing": housing,
    }
    known = {side: value for side, value in sides.items() if value is not None}
    return [f"heat.{side}_temperature_degc={value}" for side, value in known.items()]


def config_of(*words, heat="chongqing_rated"):
    return compose("generate", [*MESH, f"heat={heat}", *words])


def duty_of(*words, **options):
    return PairParts(config_of(*words, **options)).duty


def variants_of(*words):
    duty = duty_of(*words)
    return duty, stiffness_variants(duty, hot_state(duty))


def heated_by(duty, **chosen):
    effects = {
        "growth": False,
        "center_distance": False,
        "softening": False,
        **chosen,
    }
    return heated(duty, hot_state(duty), **effects)


def test_without_heat_it_is_the_cold_pair():
    duty = duty_of(heat="none")
    assert as_configured(duty) is duty.system
    assert read_sliced_pair(compose("generate", MESH)) == duty.system
    for variant in variants_of(*at(20, housing=20))[1].values():
        assert_close(
            variant.single,
            duty.system.single_pair(401)[1],
            1e-12,
        )


def test_papers_hot_teeth_without_a_rise_are_cold():
    """Bulk at the reference temperature and no friction; a rise changes them, by each law."""
    words = "mesh.heat_law=paper", *at(20, housing=20), f"{FRICTION}=0"
    duty, variants = variants_of(*words)
    for name, other in (
        ("paper", "cold"),
        ("paper_cold", "cold"),
        ("paper_components", "paper_cold_components"),
    ):
        assert_close(variants[name].mesh, variants[other].mesh, 1e-12)
        assert_close(variants[name].single, variants[other].single, 1e-12)
    rubs = variants_of(*words[:-1])[1]
    assert np.abs(rubs["paper"].mesh / rubs["cold"].mesh - 1.0).max() > 1e-4
    assert_close(as_configured(duty).single_pair()[1], variants["cold"].single, 1e-12)


@pytest.mark.parametrize("law", ["one_sided", "paper"])
def test_records_have_the_papers_hot_teeth(law):
    """The table that the dynamics read is stiff as the pair is, and unlike that of gensig's law."""
    words = f"mesh.law={law}", *at(70), "heat.softening=false", "gear.backlash_um=900"
    hot, grown, cold = (
        read_system(config_of(*words, f"mesh.heat_law={name}", heat=heat))
        for name, heat in (
            ("paper_contact", "chongqing_rated"),
            ("grown", "chongqing_rated"),
            ("grown", "none"),
        )
    )
    assert hot.flanks.hot_teeth is not None
    assert grown.flanks.hot_teeth is None
    tables = [machine.mesh_table().pairs.compliance for machine in (hot, grown, cold)]
    assert np.abs(tables[0] / tables[1] - 1.0).max() > 1e-4
    plain = replace(hot.flanks, hot_teeth=None).mesh_table().pairs.compliance
    assert np.abs(tables[0] / plain - 1.0).max() > 1e-4


def test_no_reading_of_the_paper_reaches_its_eleven_per_cent():
    """Nor do angles that count twice; hot tips at held shafts reach half of it, in the mean."""
    held = *at(90, 70, 20), "gear.backlash_um=4000"
    for name in READINGS:
        _, variants = variants_of(f"mesh.heat_law={name}", *held)
        for variant in ("paper", "paper_components"):
            cold = compared(variants, variant)
            assert abs(variants[variant].mesh.mean() / cold.mesh.mean() - 1.0) < 0.004
        housed, cold = variants["paper_contact_ratio"], variants["paper_cold"]
        assert 0.03 < housed.mesh.mean() / cold.mesh.mean() - 1.0 < 0.07
        assert housed.single.max() / cold.single.max() - 1.0 < 0.03


def test_gears_and_housing_equally_hot_are_as_stiff_per_width():
    """In-plane stiffness is independent of the size; the wider face makes them stiffer."""
    duty, variants = variants_of(*at(70, housing=70))
    factor = 1.0 + duty.heat.expansion * 50.0
    for name in ("true", "contact_ratio"):
        for curve in ("mesh", "single"):
            cold = getattr(variants["cold"], curve)
            assert_close(
                getattr(variants[name], curve),
                cold * factor,
                1e-7,
            )


def test_softening_is_that_of_the_modulus():
    """With a linear contact stiffness is proportional to Young's modulus."""
    switched_off = "heat.growth=false", "heat.center_distance=false"
    duty, variants = variants_of(
        *at(70, housing=70),
        *switched_off,
    )
    assert set(variants) == {"cold", "softened"}

    ratio = duty.heat.modulus_ratio(70.0)
    assert 0.98 < ratio < 0.99
    assert_close(
        variants["softened"].mesh,
        variants["cold"].mesh * ratio,
        1e-9,
    )


@pytest.mark.parametrize(
    ("pinion", "wheel"),
    [(70, 70), (90, 40), (45, 80)],
)
def test_gears_hotter_than_the_housing_have_a_longer_path_of_contact(pinion, wheel):
    """Against the path of gears that are each grown, at the housing's centre distance."""
    duty = duty_of(*at(pinion, wheel, 30), "gear.backlash_um=2000")
    cold, expansion = duty.system.pair, duty.heat.expansion
    hot = heated_by(duty, growth=True, center_distance=True).pair
    distance = cold.center_distance * (1 + 10 * expansion)

    assert_close(hot.center_distance, distance, 1e-9)

    growth = 1 + expansion * np.array([pinion - 20, wheel - 20])
    gears = cold.pinion, cold.wheel
    base = growth @ [gear.base_radius for gear in gears]
    tips = [math.sqrt(gear.tip_radius**2 - gear.base_radius**2) for gear in gears]
    path = growth @ tips - math.sqrt(distance**2 - base**2)
    pitch = math.tau * base / sum(gear.n_teeth for gear in gears)
    exact = path / pitch
    assert exact > cold.transverse_contact_ratio + 0.01

    # tips grow by the common strain: an error of the difference of strains times the curvature
    tolerance = 1e-6 if pinion == wheel else 0.006
    assert_close(hot.transverse_contact_ratio, exact, atol=tolerance)
    assert hot.backlash < cold.backlash


def test_a_hotter_pinion_loads_the_leaving_pair():
    early = []
    for words in (at(70, housing=70), at(90, 50)):
        system = heated_by(duty_of(*words), growth=True)
        contact = system.transmission_error().contact
        approaching = contact.position < system.pair.pitch_point
        early.append(contact.line_load[approaching].sum() / contact.line_load.sum())
    assert early[1] < 0.9 * early[0]


def test_apparent_stiffness_is_force_over_the_approach_less_growth():
    duty, variants = variants_of(*at(30))
    thermal = hot_state(duty).growth.teeth_alone(duty.system.pair)
    cold, apparent = variants["cold"], variants["apparent"]

    assert_close(thermal, 10 * 0.345e-6, 0.02)

    left = cold.approach - thermal
    assert_close(apparent.mesh, duty.system.mesh_force / left, 1e-12)

    raised = apparent.single.max() / cold.single.max()
    assert_close(
        raised,
        cold.approach.mean() / left.mean(),
        1e-12,
    )

    hotter = *at(120), "gear.backlash_um=3000", "heat.center_distance=false"
    assert "apparent" not in variants_of(*hotter)[1]


def test_sweeps():
    """Friction heats the gears and leaves the cold load; heat is proportional to speed."""
    duty = duty_of("heat.softening=false")
    cool, hot = sweep(duty, "friction", [0.03, 0.07])
    assert_array_equal(cool["cold"].mesh, hot["cold"].mesh)

    cool, hot = (each["contact_ratio"].transverse_contact_ratio for each in (cool, hot))
    assert hot > cool

    slow, fast = (hot_state(replace(duty, speed=speed)) for speed in (60.0, 120.0))
    assert_close(fast.friction_heat, 2.0 * slow.friction_heat, 1e-12)

    torques = sweep(duty, "torque", [12e3, 24e3])
    light, heavy = (each["cold"].approach.mean() for each in torques)
    assert_close(light, 0.5 * heavy, 1e-9)

    with refused("a sweep over 'oil'; allowed: friction, torque, speed"):
        sweep(duty, "oil", [1.0])


@pytest.mark.parametrize(
    ("known_at", "power", "rtol"),
    [("null", 1.0, 1e-9), ("600", 0.5, 0.02)],
)
def test_cooling_grows_with_the_root_of_the_speed(known_at, power, rtol):
    """Friction heat grows with the speed; with weak cooling the temperature keeps its shape."""
    words = f"heat.convection_speed_rpm={known_at}", "heat.conductivity_w_per_mk=500"
    duty = duty_of(*words)

    def rise(heat, speed):
        state = hot_state(replace(duty, heat=heat, speed=speed))
        return state.pinion.tooth - heat.oil_temperature

    slow, fast = (rise(duty.heat, speed) for speed in (60.0, 240.0))

    assert_close(fast / slow, 4.0**power, rtol)

    fixed = replace(duty.heat, convection_speed=None)
    at_600_rpm = (rise(heat, 20.0 * math.pi) for heat in (fixed, duty.heat))
    assert_close(*at_600_rpm, 1e-9)


def test_heat_is_shared_and_the_flash_lifts_a_flank_by_less_than_a_tenth_of_a_micrometre():
    """A skin of some 30 um: no tooth grows by it."""
    duty = duty_of("heat.pinion_heat_share=0.3")
    state = hot_state(duty)
    shares = state.pinion.input, state.wheel.input

    assert_close(
        shares,
        np.array([0.3, 0.7]) * state.friction_heat,
        1e-12,
    )
    assert state.flash.max() > 20.0
    assert 0.0 < flash_skin_growth(duty, state) < 0.1e-6


def test_modification_and_growth_of_flanks_add():
    words = "heat.center_distance=false", *at(90, 50)
    hot = read_sliced_pair(config_of(*words))
    relief = FlankModification(tip_relief=20e-6, tip_relief_height=6e-3)
    relieved = replace(
        hot,
        modification=replace(hot.modification, pinion=relief),
    )
    cold, ground = replace(hot, growth=None), replace(relieved, growth=None)
    gaps = [pair.sliced_mesh().gap for pair in (cold, hot, ground, relieved)]
    plain, *others = (np.where(np.isfinite(gap), gap, 0.0) for gap in gaps)
    by_heat, by_relief, by_both = (gap - plain for gap in others)

    assert min(np.ptp(by_heat), np.ptp(by_relief)) > 1e-6
    assert_close(by_both, by_heat + by_relief, atol=1e-15)


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        (at(120), GeometryError, "the gears jam: heat makes them grow"),
        ([f"{FRICTION}=0.5"], ExtrapolationError, "pinion: a temperature of"),
        (UNCOOLED, ConfigError, "pinion: nothing cools it"),
        (
            [*at(150), "gear.backlash_um=9000"],
            GeometryError,
            "gears grown against the housing by heat: pinion: contact would reach",
        ),
    ],
)
def test_too_much_heat_is_refused_in_one_line(words, error, message):
    with refused(message, error) as caught:
        read_sliced_pair(config_of(*words))
    assert str(caught.value).startswith(message)


def spur_of(*words, heat="chongqing_rated"):
    return read_system(compose("generate", [f"heat={heat}", *words]))


def test_both_flanks_of_spur_teeth_open_the_gap_that_slices_have():
    pair = spur_of(*at(95, 60))
    sound, hot = spur_of(heat="none").mesh_table(), pair.mesh_table()
    share = hot.position / pair.pair.path_of_contact
    on_path = (share > 0.02) & (share < 0.98)  # flanks of whole teeth end in edges
    opened = [side_of(hot, gear).gap[0] - side_of(sound, gear).gap[0] for gear in SIDES]
    growth = pair.modification.growth
    expected = growth.deviation(pair.pair, hot.position)
    assert np.ptp(expected[on_path]) > 2e-6
    assert_close(sum(opened)[on_path], expected[on_path], atol=2e-8)


def test_spur_teeth_as_warm_as_their_mates_and_housing_only_soften():
    pair = spur_of(*at(60, 60, 60))
    drawn = spur_of(heat="none")
    position = pair.mesh_table().position
    assert_close(
        pair.modification.growth.deviation(pair.pair, position), 0.0, atol=1e-9
    )
    assert pair.material.youngs_modulus < drawn.material.youngs_modulus
    assert pair.pair.base_pitch > drawn.pair.base_pitch
    assert_close(
        pair.pair.transverse_contact_ratio,
        drawn.pair.transverse_contact_ratio,
        rtol=1e-9,
    )


def test_linear_law_takes_softening_without_growth():
    words = ["mesh.law=paper", "heat.growth=false", "heat.center_distance=false"]
    pair = spur_of(*words)
    assert pair.modification.growth is None
    assert pair.material.youngs_modulus < spur_of(heat="none").material.youngs_modulus


class TestWarmingUp:
    """Gears some time after they began to run at the reference temperature."""

    def bodies(self, *words):
        state = hot_state(duty_of(*words))
        return state.pinion, state.wheel

    def test_they_begin_cold_and_end_steady(self):
        for body in self.bodies("heat.running_time_s=0"):
            assert_close(body.temperature, 20.0, 1e-12)
        late, steady = self.bodies("heat.running_time_s=1e5"), self.bodies()
        for one, other in zip(late, steady, strict=True):
            assert_close(one.temperature, other.temperature, 1e-9)
            assert_close(one.to_oil, other.to_oil, 1e-9)

    def test_heat_that_does_not_leave_warms_the_body(self):
        """Input less output over the heat capacity is the change of the mean temperature."""
        duty = duty_of("heat.running_time_s=300")
        pair, material = duty.system.pair, duty.system.material
        before, now, after = (
            self.bodies(f"heat.running_time_s={time}") for time in (299, 300, 301)
        )
        for side, gear in enumerate((pair.pinion, pair.wheel)):
            change = 0.5 * (after[side].mean - before[side].mean)
            body = now[side]
            stored = body.input - body.to_oil - body.to_bore
            found = stored / heat_capacity(gear, material, duty.heat)
            assert found > 0.01
            assert_close(found, change, 1e-5)

    def test_a_small_gear_is_warm_first(self):
        duty = duty_of()
        cooling = duty.heat.at_speed(duty.speed)
        pinion, wheel = (
            time_constant(gear, duty.system.material, cooling)
            for gear in (duty.system.pair.pinion, duty.system.pair.wheel)
        )
        assert 60.0 < pinion < 0.7 * wheel < 3600.0

    def test_refusals(self):
        with refused("heat.running_time_s = -1 must not be negative"):
            duty_of("heat.running_time_s=-1")
        words = [*UNCOOLED, "heat.pinion_bore_temperature_degc=60"]
        words.append("heat.wheel_bore_temperature_degc=60")
        with refused("pinion: heat.running_time_s needs convection"):
            self.bodies(*words, "heat.running_time_s=10")


def test_a_plan_varies_heat():
    """Records of one set are cold, warming and hot."""
    config = config_of()
    warm = config.with_values({"heat.running_time_s": 120.0})
    assert PairParts(warm).duty.heat.running_time == 120.0
    hotter = config.with_values({"heat.oil_temperature_degc": 80.0})
    rise = (
        hot_state(PairParts(hotter).duty).pinion.tooth
        - hot_state(PairParts(config).duty).pinion.tooth
    )
    assert_close(rise, 20.0, 0.05)
