"""Hot teeth by the thermal paper's equations: each equation by a number, and its laws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.errors import ConfigError
from gensig.geometry.tooth import healthy_tooth
from gensig.geometry.tooth_profile import load_angle, tooth_profile
from gensig.mesh.fillet_foundation import body_coefficients
from gensig.mesh.options import CHOICES
from gensig.mesh.pair_table import structural_terms
from gensig.mesh.thermal.paper_growth import (
    READINGS,
    HotGear,
    PaperGrowth,
    Reading,
    gear_growth,
    no_growth,
    shift_angle,
)
from gensig.mesh.thermal.paper_teeth import TERMS, paper_terms
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

EXPANSION, NU = 12e-6, 0.3
RIGHT = Reading(has_printed_body=False)
SIDES = ("pinion", "wheel")


@pytest.fixture(scope="module")
def flanks():
    """The paper's pair by its conventions."""
    return PairParts(
        compose(
            "generate",
            [
                "system=helical_pair",
                "gear=chongqing_40_162",
                "mesh.law=paper",
                "mesh.contact=linear",
                "mesh.allow_extrapolation=true",
            ],
        )
    ).cold_flanks


def grown(gear, reading=RIGHT, bore_rise=100.0, tooth_rise=100.0):
    return gear_growth(
        gear,
        reading,
        bore_rise=bore_rise,
        tooth_rise=tooth_rise,
        expansion=EXPANSION,
        poisson_ratio=NU,
    )


def growth_of(flanks, name, *, rise=0.0, flash=0.0):
    pair = flanks.pair
    gears = {
        side: grown(gear, READINGS[name], rise, rise)
        for side, gear in pair.gears.items()
    }
    return PaperGrowth(
        reading=name,
        **gears,
        flash_position=(0.0, pair.path_of_contact),
        flash_strain=(EXPANSION * flash, EXPANSION * flash),
    )


def terms_of(flanks, growth, side="pinion"):
    position = np.linspace(0.0, flanks.pair.path_of_contact, 300)
    plane = flanks.material.in_plane(flanks.mesh.elasticity)
    return paper_terms(flanks.pair, side, position, plane, flanks.mesh, growth)


def total(flanks, growth):
    return sum(
        flanks.pair.gears[side].face_width
        * sum(terms_of(flanks, growth, side).values())
        for side in SIDES
    )


def test_every_reading_is_a_choice_of_the_option():
    assert CHOICES["heat_law"] == ("grown", *READINGS)
    with refused("mesh.heat_law = 'hot'; readings: paper", ConfigError):
        no_growth("hot")


@pytest.mark.parametrize("side", SIDES)
def test_an_even_rise_grows_both_circles_by_their_radius(flanks, side):
    """Eqs. (6) and (9) as printed; eq. (8) only with Poisson's ratios put right."""
    gear = flanks.pair.gears[side]
    assert (
        gear.root_radius > gear.base_radius
    )  # so (9) is the root's, and (8) the base's
    even = EXPANSION * 100.0
    right, printed = grown(gear), grown(gear, READINGS["paper"])
    assert_close(right.base, even * gear.base_radius, 1e-12)
    assert_close([right.root, printed.root], even * gear.root_radius, 1e-12)
    assert abs(printed.base / right.base - 1.0) > 0.05


@pytest.mark.parametrize("n_teeth", [23, 40])
@pytest.mark.parametrize("bore_rise", [0.0, 30.0, 150.0])
def test_displacements_solve_the_disc(flanks, bore_rise, n_teeth):
    """Eq. (5) by quadrature with the temperature of eq. (4), at both circles.

    Of few teeth the base circle is the outer one.
    """
    gear = replace(flanks.pair.pinion, n_teeth=n_teeth, bore_radius=0.06)
    rise, bore = 100.0, gear.bore_radius
    outer = max(gear.base_radius, gear.root_radius)
    assert (gear.base_radius > gear.root_radius) == (n_teeth == 23)

    def moment(upper):
        r = np.linspace(bore, upper, 20001)
        heat = bore_rise + (rise - bore_rise) * np.log(r / bore) / np.log(outer / bore)
        return np.trapezoid(heat * r, r)

    def expected(r):
        ring = outer**2 - bore**2
        own = (1.0 + NU) / r * moment(r)
        solid = (r * (1.0 - NU) + bore**2 * (1.0 + NU) / r) / ring * moment(outer)
        return EXPANSION * (own + solid)

    moved = grown(gear, bore_rise=bore_rise)
    assert_close(moved.base, expected(gear.base_radius), 1e-7)
    assert_close(moved.root, expected(gear.root_radius), 1e-7)


def test_points_of_the_profile_by_hand(flanks):
    """Eqs. (10) to (12) and (15) with round numbers: u_b = 0.1 mm, lambda dT = 0.001."""
    gear = flanks.pair.pinion
    growth = replace(grown(gear), base=1e-4)
    hot = HotGear(gear=gear, growth=growth, reading=READINGS["paper"])
    base, radius, half = gear.base_radius, 0.25, 0.03
    strain = np.array([[1e-3]])
    at = strain, np.array([radius]), np.array([half])
    moved, angle = hot.outline(*at)
    by_hand = radius + 1e-4 + 1e-3 * (radius - base)
    wider = 1e-3 * 2.0 * radius * half / (2.0 * by_hand)
    at_base = 1e-3 * base * gear.half_tooth_angle_base / (base + 1e-4)
    assert_close(moved, by_hand, 1e-14)
    assert_close(angle, half + wider - at_base, 1e-14)
    assert at_base > wider  # by theta'(0) in alpha_2 the tooth is thinner, not thicker
    for name, expected in (("paper_twice", half + wider), ("paper_once", half)):
        angle = replace(hot, reading=READINGS[name]).outline(*at)[1]
        assert_close(angle, expected, 1e-14)


def test_the_misprinted_base_angle_lacks_the_profile_shift(flanks):
    gear = flanks.pair.pinion
    printed = math.pi / (2.0 * gear.n_teeth)
    alpha = gear.transverse_pressure_angle
    printed += math.tan(alpha) - alpha
    right = HotGear(gear=gear, growth=grown(gear), reading=RIGHT)
    misprinted = replace(right, reading=READINGS["paper_misprints"])
    assert_close(misprinted.base_half_angle, printed, 1e-12)
    assert_close(right.base_half_angle - printed, shift_angle(gear), 1e-12)


@pytest.mark.parametrize("name", READINGS)
def test_load_angles_turn_with_the_normal_where_the_tooth_enters(flanks, name):
    """Eq. (20), its slope by finite differences of the hot profile."""
    gear, rules = flanks.pair.pinion, READINGS[name]
    hot, strain = HotGear(gear=gear, growth=grown(gear, rules), reading=rules), 2e-3
    start = 0.5 * gear.base_radius * math.tan(gear.transverse_pressure_angle)
    near = start + np.array([-1e-6, 1e-6])
    base = gear.base_radius

    def normal(hot, strain):
        at = np.array([[strain]]), np.hypot(base, near), hot.half_angle(near / base)
        radius, angle = (values[0] for values in hot.outline(*at))
        x, z = radius * np.cos(angle), radius * np.sin(angle)
        return math.atan2(z[0] - z[1], x[1] - x[0])

    at_rest = replace(hot, growth=no_growth(name).pinion)
    turned = normal(hot, strain) - normal(at_rest, 0.0)
    curvature = np.linspace(start, 1.5 * start, 5)
    found = hot.load_angle(curvature, (start, strain))
    assert_close(found - load_angle(gear, curvature), turned, atol=1e-8)


@pytest.mark.parametrize("side", SIDES)
def test_without_growth_every_term_is_that_of_cold_teeth(flanks, side):
    """Eqs. (24) to (29) put right are gensig's own, term by term; as printed they are not."""
    pair = flanks.pair
    position = np.linspace(0.0, pair.path_of_contact, 300)
    plane = flanks.material.in_plane(flanks.mesh.elasticity)
    cold = structural_terms(
        healthy_tooth(pair.gears[side]),
        pair.curvature(side, position),
        plane,
        flanks.mesh,
    )
    for name in READINGS:
        hot = terms_of(flanks, no_growth(name), side)
        for term in TERMS:
            changed = np.max(np.abs(hot[term] / cold[term] - 1.0))
            assert (changed > 0.005) == READINGS[name].has_misprints, (name, term)
            assert changed < 1e-12 or READINGS[name].has_misprints, (name, term)


def test_misprints_by_hand(flanks):
    """Eq. (28) with z(0), and eq. (29) with u_r = x - R_f and alpha_3 of eq. (17), cold."""
    pair = flanks.pair
    gear, name = pair.pinion, "paper_misprints"
    position = np.linspace(0.0, pair.path_of_contact, 300)
    curvature = pair.curvature("pinion", position)
    hot = HotGear(gear=gear, growth=no_growth(name).pinion, reading=READINGS[name])
    base, alpha_2 = gear.base_radius, hot.base_half_angle
    roll = curvature / base
    contact = np.hypot(base, curvature) * np.cos(alpha_2 - roll + np.arctan(roll))
    profile = tooth_profile(gear)
    root_radius = math.hypot(profile.abscissa[0], profile.half_thickness[0])
    root_half = math.atan2(profile.half_thickness[0], profile.abscissa[0])
    root = root_radius * math.cos(root_half - shift_angle(gear))
    plane = flanks.material.in_plane(flanks.mesh.elasticity)
    young = plane.youngs_modulus * gear.face_width
    angle = load_angle(gear, curvature)
    found = terms_of(flanks, no_growth(name))
    axial = np.sin(angle) ** 2 * (contact - root) / (young * 2.0 * base)
    assert_close(found["axial"], axial / math.sin(alpha_2), 1e-9)
    values = body_coefficients(gear, allow_extrapolation=True)
    alpha_3 = math.asin(base * math.sin(alpha_2) / gear.root_radius)
    lever = (contact - gear.root_radius) / (2.0 * gear.root_radius * alpha_3)
    bracket = values["L"] * lever**2 + values["M"] * lever
    bracket += values["P"] * (1.0 + values["Q"] * np.tan(angle) ** 2)
    assert_close(found["foundation"], np.cos(angle) ** 2 * bracket / young, 1e-12)


def test_an_even_rise_leaves_stiffness_alone_only_if_angles_grow_once(flanks):
    """A similar gear is as stiff per width: the equations as printed are not neutral."""
    change = {
        name: total(flanks, growth_of(flanks, name, rise=100.0))
        / total(flanks, no_growth(name))
        - 1.0
        for name in READINGS
    }
    assert np.abs(change.pop("paper_once")).max() < 1e-12
    for name, values in change.items():
        assert np.abs(values).max() > 2e-4, name
    # counted twice, angles make all of the path stiffer
    assert change["paper_twice"].max() < 0.0
    assert change["paper_contact"].min() > 0.0


@pytest.mark.parametrize("name", READINGS)
def test_more_flash_makes_teeth_softer_in_every_reading(flanks, name):
    """Monotone, and in proportion for small strains."""
    cold, warm, hot = (
        total(flanks, growth_of(flanks, name, flash=flash)).mean()
        for flash in (0.0, 20.0, 40.0)
    )
    assert cold < warm < hot
    assert_close((hot - cold) / (warm - cold), 2.0, 0.01)
