"""Laws of ball bearings under radial load, and of the support by two of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from refusals import given, refused

from gensig.dynamics.bearing import (
    BallBearing,
    Shaft,
    ball_coefficient,
    bearing_equilibrium,
    bearing_stiffness,
    cage_positions,
    point_contact_coefficient,
    support_stiffness,
)
from gensig.material import Material

STEEL = Material(
    youngs_modulus=206e9,
    poisson_ratio=0.3,
    density_kg_per_m3=7850,
)
SMALL = BallBearing(
    n_balls=8,
    ball_diameter=6.746e-3,
    pitch_diameter=28.5e-3,
    inner_groove_conformity=0.52,
    outer_groove_conformity=0.52,
    radial_clearance=0.0,
)
LARGE = replace(
    SMALL,
    n_balls=9,
    ball_diameter=7.94e-3,
    pitch_diameter=39.04e-3,
)
LOOSE = replace(SMALL, radial_clearance=10e-6)
TIGHT = replace(SMALL, radial_clearance=-5e-6)
SHAFT = Shaft(diameter=18e-3, span=80e-3)
BOTH = pytest.mark.parametrize(
    "bearing",
    [SMALL, LARGE],
    ids=["6203", "6205"],
)
LOADS = pytest.mark.parametrize("load", [20.0, 460.0, 5000.0])


def test_a_ball_s_coefficient_is_that_of_its_bearing_and_material():
    """Whatever was asked before; Hertz: it grows with the root of the size and with E."""
    double = replace(
        SMALL,
        ball_diameter=2 * SMALL.ball_diameter,
        pitch_diameter=2 * SMALL.pitch_diameter,
    )
    stiff = replace(STEEL, youngs_modulus=2 * STEEL.youngs_modulus)
    first = ball_coefficient(SMALL, STEEL)
    assert_close(ball_coefficient(double, STEEL), math.sqrt(2.0) * first, 1e-9)
    assert_close(ball_coefficient(SMALL, stiff), 2.0 * first, 1e-9)
    assert ball_coefficient(SMALL, STEEL) == first


def equilibrium(bearing, load, *angles):
    positions = np.array(angles) if angles else cage_positions(bearing)
    return bearing_equilibrium(bearing, STEEL, load, positions)


class TestHertz:
    def test_two_spheres(self):
        """Circular contact has a closed form: K = 4/3 E* sqrt(R)."""
        radius = 4e-3
        modulus = STEEL.youngs_modulus / (2 * (1 - 0.3**2))
        expected = 4.0 / 3.0 * modulus * math.sqrt(radius / 2)
        curvatures = (1 / radius,) * 4

        assert_close(
            point_contact_coefficient(curvatures, STEEL),
            expected,
            1e-9,
        )

        nearly = (*curvatures[:3], 1.001 / radius)
        assert_close(
            point_contact_coefficient(nearly, STEEL),
            expected,
            1e-3,
        )

    @BOTH
    @pytest.mark.parametrize("race", ["inner", "outer"])
    def test_a_ball_in_a_groove_as_brewe_and_hamrock_fit_it(self, bearing, race):
        """Brewe & Hamrock (1977): kappa and integrals as powers of Ry / Rx, within 3 %."""
        ball, _, along, across = bearing.groove_curvatures(race)
        ratio = (ball + along) / (ball + across)
        kappa = 1.0339 * ratio**0.6360
        second = 1.0003 + 0.5968 / ratio
        first = 1.5277 + 0.6023 * math.log(ratio)
        modulus = STEEL.youngs_modulus / (1 - 0.3**2)
        root = math.sqrt(second / (4.5 * (2 * ball + along + across) * first**3))
        coefficient = point_contact_coefficient((ball, ball, along, across), STEEL)

        assert ratio > 10
        assert_close(coefficient, math.pi * kappa * modulus * root, 0.03)


def palmgren(load, bearing):
    """Deflection of a ball between both races: 0.0020 (Q^2 / D)^(1/3) mm, Q in kgf."""
    square = (load / 9.80665) ** 2 / (1e3 * bearing.ball_diameter)
    return 1e-3 * 0.0020 * square ** (1 / 3)


class TestEquilibrium:
    @pytest.mark.parametrize("bearing", [SMALL, LARGE, LOOSE, TIGHT])
    @LOADS
    def test_the_balls_carry_the_load(self, bearing, load):
        state = equilibrium(bearing, load)
        balls = np.arange(bearing.n_balls)
        angle = cage_positions(bearing)[:, None] + 2 * np.pi * balls / bearing.n_balls

        assert_close(
            (state.ball_load * np.cos(angle)).sum(axis=1),
            load,
            1e-9,
        )

        across = (state.ball_load * np.sin(angle)).sum(axis=1)
        assert_close(across, 0.0, atol=1e-9 * load)
        assert np.all(state.ball_load >= 0.0)

        if bearing is not TIGHT:
            assert np.all(state.ball_load[np.cos(angle) < -0.2] == 0.0)

    @pytest.mark.parametrize("bearing", [SMALL, LARGE, LOOSE, TIGHT])
    def test_the_tangent_is_the_change_of_force(self, bearing):
        low, here, high = (equilibrium(bearing, 460.0 + d) for d in (-0.01, 0.0, 0.01))
        compliance = np.linalg.inv(here.stiffness)[:, :, 1]
        moved = (high.displacement - low.displacement) / 0.02

        assert_close(
            moved,
            compliance,
            1e-3,
            atol=1e-4 * np.abs(compliance).max(),
        )

    def test_stribeck(self):
        """A ball on the load's line carries 4.37 F / Z without clearance, about 5 F / Z with it."""
        for n_balls, tolerance in (
            (8, 0.02),
            (9, 0.02),
            (20, 0.005),
        ):
            bearing = replace(SMALL, n_balls=n_balls, pitch_diameter=80e-3)
            largest = equilibrium(bearing, 500.0, 0.0).ball_load.max()
            assert_close(largest * n_balls / 500.0, 4.37, tolerance)
        assert_close(
            equilibrium(LOOSE, 500.0, 0.0).ball_load.max() * 8 / 500.0,
            5,
            0.02,
        )


class TestStiffness:
    @BOTH
    @LOADS
    def test_palmgren_and_gargiulo(self, bearing, load):
        """Palmgren with Q = 5 F / Z, and Gargiulo (1980), 0.0325e6 (D F Z^2)^(1/3) lb/in."""
        n = bearing.n_balls
        inch = 0.0254
        pound = 4.448222
        product = bearing.ball_diameter / inch * load / pound * n**2
        gargiulo = 0.0325e6 * product ** (1 / 3) * pound / inch
        across, along = bearing_stiffness(bearing, STEEL, load)

        assert_close(along, gargiulo, 0.1)
        assert_close(
            along,
            1.5 * load / palmgren(5 * load / n, bearing),
            0.1,
        )

        deflection = (load / ball_coefficient(bearing, STEEL)) ** (2 / 3)
        assert_close(deflection, palmgren(load, bearing), 0.1)
        assert 0.0 < across < along

    @BOTH
    def test_it_grows_with_the_cube_root_of_the_load(self, bearing):
        low, high = (
            np.array(bearing_stiffness(bearing, STEEL, load)) for load in (50.0, 400.0)
        )
        assert_close(high / low, 2.0, 1e-6)

        loose = replace(bearing, radial_clearance=10e-6)
        low, high = (bearing_stiffness(loose, STEEL, load)[0] for load in (50.0, 400.0))
        assert high / low > 2.2

    def test_many_balls_without_clearance(self):
        """Half of the ring loaded by cos^1.5: the ratio is (I_0.5 - I_2.5) / I_2.5 = 2/3."""
        many = replace(SMALL, n_balls=50, pitch_diameter=0.2)
        across, along = bearing_stiffness(many, STEEL, 460.0)
        assert_close(across / along, 2 / 3, 2e-3)

    def test_strong_preload_is_isotropic_and_clearance_softens(self):
        tight = replace(SMALL, radial_clearance=-20e-6)
        across, along = bearing_stiffness(tight, STEEL, 1.0)
        assert_close(across, along, 1e-4)

        across, along = bearing_stiffness(tight, STEEL, 3000.0)
        assert abs(along / across - 1) > 0.02

        clearances = [replace(SMALL, radial_clearance=p) for p in (0.0, 5e-6, 20e-6)]
        softer = [bearing_stiffness(bearing, STEEL, 460.0)[0] for bearing in clearances]
        assert softer[0] > softer[1] > softer[2]


@pytest.mark.parametrize("span", [1e-3, 80e-3, 0.6])
def test_a_support_is_two_bearings_in_series_with_a_beam(span):
    shaft = replace(SHAFT, span=span)
    bearings = bearing_stiffness(SMALL, STEEL, 460.0)
    beam = 48 * 206e9 * math.pi * 18e-3**4 / 64 / span**3
    expected = [2 * k * beam / (2 * k + beam) for k in bearings]

    assert_close(
        support_stiffness(SMALL, shaft, STEEL, 920.0),
        expected,
        1e-9,
    )


REFUSED = {
    "small.n_balls=3": "bearing.n_balls = 3 must lie in 5..60",
    "small.ball_diameter=0.0": "bearing.ball_diameter_mm = 0 must be positive",
    "small.pitch_diameter=15e-3": "size touch each other; give more than 17.63",
    "small.inner_groove_conformity=0.5": "conformity = 0.5 must lie in 0.505..0.6",
    "small.outer_groove_conformity=0.7": "conformity = 0.7 must lie in 0.505..0.6",
    "small.radial_clearance=2e-4": "clearance_um = 200 must lie in -20..100",
    "shaft.diameter=0.0": "shaft.diameter_mm = 0 must be positive",
    "shaft.span=0.0": "shaft.span_mm = 0 must be positive",
}


@pytest.mark.parametrize(("change", "text"), REFUSED.items())
def test_impossible_sizes_are_refused(change, text):
    ((place, value),) = given(change).items()
    part, key = place.split(".")
    with refused(text):
        replace({"small": SMALL, "shaft": SHAFT}[part], **{key: value})
