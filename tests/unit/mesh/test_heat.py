"""Friction heat and flash temperature: laws, and inputs that are refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.errors import ConfigError, ExtrapolationError
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import loaded_contact
from gensig.mesh.thermal.heat import (
    BLOK_SEMI_WIDTH,
    contact_half_width,
    flash_temperature,
    friction_heat,
    rolling_speeds,
)
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

SPEED = 125.0


@pytest.fixture(scope="module")
def duty():
    return PairParts(
        compose(
            "generate",
            [
                "system=helical_pair",
                "gear=chongqing_40_162",
                "heat=chongqing_rated",
            ],
        )
    ).duty


def flash(duty, position, load, *, friction=0.05, speed=SPEED):
    return flash_temperature(
        duty.system.pair,
        position,
        load,
        duty.system.material,
        duty.heat,
        friction=friction,
        speed=speed,
    )


def test_friction_heat_is_friction_times_load_times_sliding(duty):
    """Even loads along the path: the mean of |v1 - v2| has a closed form."""
    pair = duty.system.pair
    force = 1e5
    n = 4000
    position = (np.arange(n) + 0.5)[None, None] / n * pair.path_of_contact
    result = friction_heat(
        pair,
        position,
        np.ones_like(position),
        force=force,
        friction=0.04,
        speed=SPEED,
    )
    before = pair.pitch_point
    after = pair.path_of_contact - pair.pitch_point
    mean = (
        0.5
        * (before**2 + after**2)
        / (before + after)
        * SPEED
        * (1.0 + 1.0 / pair.ratio)
    )

    assert_close(
        result,
        0.04 * force / math.cos(pair.base_helix_angle) * mean,
        1e-6,
    )


def test_sliding_vanishes_at_the_pitch_point_alone(duty):
    pair = duty.system.pair
    position = np.array([0.0, pair.pitch_point, pair.path_of_contact])
    pinion, wheel = rolling_speeds(pair, position, SPEED)

    assert_close(pinion[1], wheel[1], 1e-12)
    assert pinion[0] < wheel[0]
    assert pinion[2] > wheel[2]
    assert_close(flash(duty, position, 3e5)[1], 0.0, atol=1e-9)


def test_flash_scales_as_blok_says(duty):
    """Friction, load^(3/4), root of speed; the reference's 28 and 64 K over 39 to 48 for 12 and 36
    kN m are that.
    """
    position = np.linspace(0.0, duty.system.pair.path_of_contact, 9)
    one = flash(duty, position, 3e5)
    assert_close(flash(duty, position, 3e5, friction=0.1), 2.0 * one, 1e-12)
    assert_close(flash(duty, position, 6e5), 2.0**0.75 * one, 1e-12)
    assert_close(
        flash(duty, position, 3e5, speed=4 * SPEED),
        2.0 * one,
        1e-12,
    )
    assert flash(duty, position, np.zeros(9)).max() == 0.0


def test_blok_s_constants_belong_to_two_widths():
    """1.11 with the full width is 0.785 with half of it."""
    assert_close(BLOK_SEMI_WIDTH * math.sqrt(2.0), 1.11, 1e-3)


def test_half_width_is_the_one_of_the_pressure(duty):
    """Hertz: the largest pressure is 2 w / (pi B)."""
    system = duty.system
    contact = loaded_contact(system.sliced_mesh(), system.phases(4), system.mesh_force)
    pressure = contact_pressure(system.sliced_mesh(), contact, system.material)
    half = contact_half_width(
        system.pair,
        contact.position,
        contact.line_load,
        system.material,
    )
    bearing = contact.line_load > 0.0

    assert bearing.any()

    expected = 2.0 * contact.line_load[bearing] / (math.pi * half[bearing])
    assert_close(pressure[bearing], expected, 1e-12)


def test_modulus_falls_by_three_per_cent_in_a_hundred_kelvin(duty):
    assert_close(duty.heat.modulus_ratio(20.0), 1.0, atol=1e-15)
    assert 0.960 < duty.heat.modulus_ratio(120.0) < 0.975
    assert_close(
        replace(duty.heat, reference_temperature=100.0).modulus_ratio(100.0),
        1.0,
        atol=1e-15,
    )


BEYOND = {
    "heat.oil_temperature_degc=400": "heat.oil_temperature_degc = 400 lies beyond the mate",
    "heat.pinion_temperature_degc=-80": "-75 to 300 degrees Celsius",
}
NO_HEAT = {
    "heat.face_convection_w_per_m2k=-1": "heat.face_convection_w_per_m2k = -1 must lie in 0..1",
    "heat.convection_speed_rpm=0": "heat.convection_speed_rpm = 0 must be positive, or null",
    "heat.pinion_heat_share=1.2": "heat.pinion_heat_share = 1.2 must lie in 0..1",
    "heat.expansion_per_k=1": "heat.expansion_per_k = 1 must lie in 0..0.0001",
    "heat.conductivity_w_per_mk=0": "heat.conductivity_w_per_mk = 0 must lie in 1..500",
    "heat.modulus_gpa=[200,190]": "has 7 and heat.modulus_gpa 2 values",
    "heat.modulus_temperature_degc=[20,10] heat.modulus_gpa=[1,2]": "temperatures that rise",
    "heat.modulus_temperature_degc=[10,20] heat.modulus_gpa=[-1,2]": "= -1 must be positive",
    "heat.growth=yes_please": "heat.growth = 'yes_please' is not true or false",
    "+heat.oil_temperature_k=300": "'oil_temperature_k'",
    "heat.oil_temperature_degc=null": "heat.oil_temperature_degc is null; give a value",
}


@pytest.mark.parametrize("words", [*BEYOND, *NO_HEAT])
def test_inputs_that_make_no_heat_are_refused(words):
    message, error = NO_HEAT.get(words), ConfigError
    if words in BEYOND:
        message, error = BEYOND[words], ExtrapolationError
    with refused(message, error):
        _ = PairParts(compose("generate", words.split())).heat


def test_a_pair_that_stands_still_is_not_heated():
    words = [
        "system=helical_pair",
        "heat=chongqing_rated",
        "operating.speed_rpm=0",
    ]
    with refused("operating.speed_rpm = 0 must be positive"):
        _ = PairParts(compose("generate", words)).duty
