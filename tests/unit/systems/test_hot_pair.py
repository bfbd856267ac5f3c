"""Hot pairs: what each effect of heat does to mesh stiffness, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gensig.errors import ConfigError, ExtrapolationError, GeometryError
from gensig.mesh.modification import FlankModification
from gensig.options.compose import compose
from gensig.systems.hot_pair import (
    as_configured,
    flash_skin_growth,
    heated,
    hot_state,
    stiffness_variants,
    sweep,
)
from gensig.systems.registry import read_duty, read_sliced_pair

MESH = [
    "system=helical_pair", "gear=chongqing_40_162", "mesh.law=paper", "mesh.pair_coupling=sum", "mesh.contact=linear",
    "mesh.slice_coupling=independent", "mesh.allow_extrapolation=true", "mesh.n_slices=20",
]  # fmt: skip
EVEN = [
    "heat.pinion_temperature_degc=70",
    "heat.wheel_temperature_degc=70",
    "heat.housing_temperature_degc=70",
]


def duty_of(*words, heat="chongqing_rated"):
    return read_duty(compose("generate", [*MESH, f"heat={heat}", *words]))


def effects(**chosen):
    return {"growth": False, "center_distance": False, "softening": False, **chosen}


def test_no_heat_is_the_same_pair_to_the_bit():
    duty = duty_of(heat="none")
    assert as_configured(duty) is duty.system
    cold = read_sliced_pair(compose("generate", MESH))
    assert cold == duty.system
    np.testing.assert_array_equal(
        cold.transmission_error().error, duty.system.transmission_error().error
    )


def test_gears_and_housing_equally_hot_are_as_stiff_per_width():
    """In-plane stiffness does not know the size: only the wider face makes them stiffer."""
    duty = duty_of(*EVEN)
    variants = stiffness_variants(duty, hot_state(duty))
    strain = duty.heat.expansion * 50.0
    for name in ("true", "contact_ratio"):
        ratio = variants[name].mesh / variants["cold"].mesh
        np.testing.assert_allclose(ratio, 1.0 + strain, rtol=1e-7)
        np.testing.assert_allclose(
            variants[name].single, variants["cold"].single * (1.0 + strain), rtol=1e-7
        )


def test_gears_at_the_reference_temperature_are_the_cold_pair():
    cool = [word.replace("=70", "=20") for word in EVEN]
    duty = duty_of(*cool)
    variants = stiffness_variants(duty, hot_state(duty))
    for variant in variants.values():
        np.testing.assert_allclose(variant.single, variants["cold"].single, rtol=1e-12)


def test_softening_is_the_modulus_s():
    """With a linear contact stiffness is proportional to Young's modulus."""
    duty = duty_of(*EVEN, "heat.growth=false", "heat.center_distance=false")
    variants = stiffness_variants(duty, hot_state(duty))
    assert set(variants) == {"cold", "softened"}
    ratio = duty.heat.modulus_ratio(70.0)
    assert 0.98 < ratio < 0.99
    np.testing.assert_allclose(
        variants["softened"].mesh / variants["cold"].mesh, ratio, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("pinion", "wheel"), [(70.0, 70.0), (90.0, 40.0), (45.0, 80.0)]
)
def test_gears_hotter_than_the_housing_reach_farther_into_each_other(pinion, wheel):
    """Against the path of contact of gears that are each grown as they are, at the housing's centre distance."""
    duty = duty_of(
        f"heat.pinion_temperature_degc={pinion}", f"heat.wheel_temperature_degc={wheel}",
        "heat.housing_temperature_degc=30", "gear.backlash_um=2000",
    )  # fmt: skip
    state, cold = hot_state(duty), duty.system.pair
    pair = heated(duty, state, **effects(growth=True, center_distance=True)).pair
    strain = {
        "pinion": (pinion - 20) * duty.heat.expansion,
        "wheel": (wheel - 20) * duty.heat.expansion,
    }
    base = {
        name: getattr(cold, name).base_radius * (1 + strain[name]) for name in strain
    }
    tip = {name: getattr(cold, name).tip_radius * (1 + strain[name]) for name in strain}
    distance = cold.center_distance * (1 + 10 * duty.heat.expansion)
    assert pair.center_distance == pytest.approx(distance, rel=1e-9)
    tangent = math.sqrt(distance**2 - sum(base.values()) ** 2)
    path = sum(math.sqrt(tip[name] ** 2 - base[name] ** 2) for name in strain) - tangent
    exact = path / (
        2 * math.pi * sum(base.values()) / (cold.pinion.n_teeth + cold.wheel.n_teeth)
    )
    assert exact > cold.transverse_contact_ratio + 0.01
    # tips are taken as grown by the common strain: wrong by the difference of the strains times their curvature
    allowed = 1e-6 if pinion == wheel else 0.006
    assert pair.transverse_contact_ratio == pytest.approx(exact, abs=allowed)
    assert pair.backlash < cold.backlash


def test_a_hotter_pinion_loads_the_pair_that_leaves():
    even = duty_of(*EVEN)
    uneven = duty_of(
        "heat.pinion_temperature_degc=90", "heat.wheel_temperature_degc=50"
    )
    loads = []
    for duty in (even, uneven):
        system = heated(duty, hot_state(duty), **effects(growth=True))
        contact = system.transmission_error().contact
        early = contact.line_load[contact.position < system.pair.pitch_point].sum()
        loads.append(early / contact.line_load.sum())
    assert loads[1] < 0.9 * loads[0]


def test_apparent_stiffness_is_force_over_what_growth_leaves_of_the_approach():
    duty = duty_of("heat.pinion_temperature_degc=30", "heat.wheel_temperature_degc=30")
    state = hot_state(duty)
    variants, thermal = (
        stiffness_variants(duty, state),
        state.growth.teeth_alone(duty.system.pair),
    )
    cold, apparent = variants["cold"], variants["apparent"]
    assert thermal == pytest.approx(10 * 0.345e-6, rel=0.02)
    np.testing.assert_allclose(
        apparent.mesh, duty.system.mesh_force / (cold.approach - thermal), rtol=1e-12
    )
    raised = apparent.single.max() / cold.single.max()
    assert raised == pytest.approx(
        cold.approach.mean() / (cold.approach.mean() - thermal), rel=1e-12
    )
    hotter = duty_of("heat.pinion_temperature_degc=120", "heat.wheel_temperature_degc=120", "gear.backlash_um=3000",
                     "heat.center_distance=false")  # fmt: skip
    assert "apparent" not in stiffness_variants(hotter, hot_state(hotter))


def test_more_friction_makes_hotter_gears_and_no_other_load():
    duty = duty_of("heat.softening=false")
    cool, hot = sweep(duty, "friction", [0.03, 0.07])
    np.testing.assert_array_equal(cool["cold"].mesh, hot["cold"].mesh)
    assert (
        hot["contact_ratio"].transverse_contact_ratio
        > cool["contact_ratio"].transverse_contact_ratio
    )
    states = [hot_state(replace(duty, speed=speed)) for speed in (60.0, 120.0)]
    assert states[1].friction_heat == pytest.approx(
        2.0 * states[0].friction_heat, rel=1e-12
    )
    slow, fast = sweep(duty, "torque", [12e3, 24e3])
    assert slow["cold"].approach.mean() == pytest.approx(
        0.5 * fast["cold"].approach.mean(), rel=1e-9
    )
    with pytest.raises(
        ConfigError, match="a sweep over 'oil'; allowed: friction, torque, speed"
    ):
        sweep(duty, "oil", [1.0])


@pytest.mark.parametrize(("known_at", "power"), [("null", 1.0), ("600", 0.5)])
def test_cooling_grows_with_the_root_of_the_speed(known_at, power):
    """Friction heat goes with speed; the faces keep their temperature's shape where cooling is so weak."""
    duty = duty_of(
        f"heat.convection_speed_rpm={known_at}", "heat.conductivity_w_per_mk=500"
    )
    slow, fast = (
        hot_state(replace(duty, speed=speed)).pinion for speed in (60.0, 240.0)
    )
    rise = [body.tooth - duty.heat.oil_temperature for body in (slow, fast)]
    assert rise[1] / rise[0] == pytest.approx(
        4.0**power, rel=1e-9 if known_at == "null" else 0.02
    )
    at_known = hot_state(replace(duty, speed=20.0 * math.pi)).pinion.tooth
    fixed = replace(
        duty, heat=replace(duty.heat, convection_speed=None), speed=20.0 * math.pi
    )
    assert hot_state(fixed).pinion.tooth == pytest.approx(at_known, rel=1e-12)


def test_heat_flows_to_the_wheel_what_the_pinion_leaves():
    duty = duty_of("heat.pinion_heat_share=0.3")
    state = hot_state(duty)
    assert state.pinion.input == pytest.approx(0.3 * state.friction_heat)
    assert state.wheel.input == pytest.approx(0.7 * state.friction_heat)


def test_flash_lifts_the_flank_by_less_than_a_tenth_of_a_micrometre():
    """A skin of some 30 um: no tooth grows by it."""
    duty = duty_of()
    state = hot_state(duty)
    assert state.flash.max() > 20.0
    assert 0.0 < flash_skin_growth(duty, state) < 0.1e-6


def test_a_modification_of_hot_flanks_adds_to_their_growth():
    words = [
        "heat.center_distance=false",
        "heat.pinion_temperature_degc=90",
        "heat.wheel_temperature_degc=50",
    ]
    hot = read_sliced_pair(compose("generate", [*MESH, "heat=chongqing_rated", *words]))
    relieved = replace(
        hot,
        modification=replace(
            hot.modification,
            pinion=FlankModification(tip_relief=20e-6, tip_relief_height=6e-3),
        ),
    )
    meshes = [
        one.sliced_mesh()
        for one in (
            replace(hot, growth=None),
            hot,
            replace(relieved, growth=None),
            relieved,
        )
    ]
    plain, grown, ground, both = (
        np.where(np.isfinite(mesh.gap), mesh.gap, 0.0) for mesh in meshes
    )
    assert np.ptp(grown - plain) > 1e-6
    assert np.ptp(ground - plain) > 1e-6
    np.testing.assert_allclose(
        both - plain, (grown - plain) + (ground - plain), atol=1e-15
    )


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        (
            ["heat.pinion_temperature_degc=120", "heat.wheel_temperature_degc=120"],
            GeometryError,
            "the gears jam: heat makes them grow",
        ),
        (
            ["mesh.friction_coefficient=0.5"],
            ExtrapolationError,
            "pinion: a temperature of",
        ),
        (
            ["heat.face_convection_w_per_m2k=0", "heat.tooth_convection_w_per_m2k=0"],
            ConfigError,
            "pinion: nothing cools it",
        ),
        (
            [
                "heat.pinion_temperature_degc=150",
                "heat.wheel_temperature_degc=150",
                "gear.backlash_um=9000",
            ],
            GeometryError,
            "gears grown against the housing by heat: pinion: contact would reach",
        ),
    ],
)
def test_heat_that_no_pair_stands_is_one_line(words, error, message):
    with pytest.raises(error) as caught:
        read_sliced_pair(compose("generate", [*MESH, "heat=chongqing_rated", *words]))
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)
