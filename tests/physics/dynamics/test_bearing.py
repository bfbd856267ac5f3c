"""Laws of ball bearings under radial load: Hertz, Stribeck, Palmgren, Gargiulo, and the support they make."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

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
from gensig.errors import ConfigError
from gensig.material import Material

STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3, density_kg_per_m3=7850)
SMALL = BallBearing(
    n_balls=8, ball_diameter=6.746e-3, pitch_diameter=28.5e-3,
    inner_groove_conformity=0.52, outer_groove_conformity=0.52, radial_clearance=0.0,
)  # fmt: skip
LARGE = replace(SMALL, n_balls=9, ball_diameter=7.94e-3, pitch_diameter=39.04e-3)
LOOSE = replace(SMALL, radial_clearance=10e-6)
TIGHT = replace(SMALL, radial_clearance=-5e-6)
SHAFT = Shaft(diameter=18e-3, span=80e-3)
BEARINGS = pytest.mark.parametrize(
    "bearing", [SMALL, LARGE, LOOSE, TIGHT], ids=["6203", "6205", "loose", "tight"]
)
TIGHTER = pytest.mark.parametrize("bearing", [SMALL, LARGE], ids=["6203", "6205"])
LOADS = pytest.mark.parametrize("load", [20.0, 460.0, 5000.0])


class TestHertz:
    def test_two_spheres(self):
        """Circular contact has a closed form: K = 4/3 E* sqrt(R)."""
        radius = 4e-3
        modulus = STEEL.youngs_modulus / (2 * (1 - 0.3**2))
        expected = 4.0 / 3.0 * modulus * math.sqrt(radius / 2)
        found = point_contact_coefficient((1 / radius,) * 4, STEEL)
        assert_allclose(found, expected, rtol=1e-9, atol=0)
        nearly = point_contact_coefficient(
            (1 / radius, 1 / radius, 1 / radius, 1.001 / radius), STEEL
        )
        assert_allclose(nearly, expected, rtol=1e-3, atol=0)

    @TIGHTER
    @pytest.mark.parametrize("race", ["inner", "outer"])
    def test_a_ball_in_a_groove_as_brewe_and_hamrock_fit_it(self, bearing, race):
        """Brewe & Hamrock (1977): kappa and integrals as powers of Ry / Rx, within 3 % of the exact ones."""
        ball, _, along, across = bearing.groove_curvatures(race)
        ratio = (ball + along) / (ball + across)
        kappa, second = 1.0339 * ratio**0.6360, 1.0003 + 0.5968 / ratio
        first = 1.5277 + 0.6023 * math.log(ratio)
        modulus = STEEL.youngs_modulus / (1 - 0.3**2)
        expected = math.pi * kappa * modulus * math.sqrt(
            second / (4.5 * (2 * ball + along + across) * first**3)
        )  # fmt: skip
        assert ratio > 10
        assert_allclose(
            point_contact_coefficient((ball, ball, along, across), STEEL),
            expected,
            rtol=0.03,
            atol=0,
        )

    @TIGHTER
    def test_palmgren(self, bearing):
        """Palmgren's deflection of a ball between both races of deep grooves: 0.0020 (Q^2 / D)^(1/3) mm, Q in kgf."""
        load = 300.0
        printed = (
            1e-3
            * 0.0020
            * ((load / 9.80665) ** 2 / (1e3 * bearing.ball_diameter)) ** (1 / 3)
        )
        found = (load / ball_coefficient(bearing, STEEL)) ** (2 / 3)
        assert_allclose(found, printed, rtol=0.1, atol=0)


class TestEquilibrium:
    @BEARINGS
    @LOADS
    def test_the_balls_carry_the_load(self, bearing, load):
        positions = cage_positions(bearing)
        state = bearing_equilibrium(bearing, STEEL, load, positions)
        angle = (
            positions[:, None]
            + 2 * np.pi * np.arange(bearing.n_balls) / bearing.n_balls
        )
        assert_allclose(
            (state.ball_load * np.cos(angle)).sum(axis=1), load, rtol=1e-9, atol=0
        )
        assert_allclose(
            (state.ball_load * np.sin(angle)).sum(axis=1), 0.0, rtol=0, atol=1e-9 * load
        )
        assert np.all(state.ball_load >= 0.0)
        if bearing is not TIGHT:
            assert np.all(state.ball_load[np.cos(angle) < -0.2] == 0.0)

    @BEARINGS
    def test_the_tangent_is_the_change_of_force(self, bearing):
        """Two loads a little apart: displacement differs by compliance times the difference, along the load."""
        load, positions = 460.0, cage_positions(bearing)
        low, here, high = (
            bearing_equilibrium(bearing, STEEL, load + d, positions)
            for d in (-0.01, 0.0, 0.01)
        )
        compliance = np.linalg.inv(here.stiffness)[:, :, 1]
        assert_allclose(
            (high.displacement - low.displacement) / 0.02,
            compliance,
            rtol=1e-3,
            atol=1e-4 * np.abs(compliance).max(),
        )

    def test_stribeck(self):
        """A ball on the load's line carries 4.37 F / Z without clearance; about 5 F / Z with the usual one."""
        for n_balls, within in ((8, 0.02), (9, 0.02), (20, 0.005)):
            bearing = replace(SMALL, n_balls=n_balls, pitch_diameter=80e-3)
            state = bearing_equilibrium(bearing, STEEL, 500.0, np.zeros(1))
            assert_allclose(
                state.ball_load.max() * n_balls / 500.0, 4.37, rtol=within, atol=0
            )
        loose = bearing_equilibrium(LOOSE, STEEL, 500.0, np.zeros(1))
        assert 4.5 < loose.ball_load.max() * 8 / 500.0 < 5.5

    def test_a_ball_on_the_line_leaves_the_ring_there(self):
        for position in (0.0, math.pi / SMALL.n_balls):
            state = bearing_equilibrium(SMALL, STEEL, 460.0, np.array([position]))
            assert abs(state.displacement[0, 0]) < 1e-12
            assert_allclose(
                state.stiffness[0, 0, 1],
                0.0,
                rtol=0,
                atol=1e-6 * state.stiffness[0, 1, 1],
            )

    def test_a_mirrored_cage_mirrors_the_equilibrium(self):
        one, other = (
            bearing_equilibrium(LOOSE, STEEL, 460.0, np.array([angle]))
            for angle in (0.2, -0.2)
        )
        assert_allclose(
            one.displacement * [-1, 1], other.displacement, rtol=0, atol=1e-12
        )
        assert_allclose(
            one.stiffness[0, 0, 1], -other.stiffness[0, 0, 1], rtol=1e-5, atol=0
        )
        assert abs(one.stiffness[0, 0, 1]) > 1e5  # so the twin above says something


class TestStiffness:
    @TIGHTER
    @LOADS
    def test_palmgren_and_gargiulo(self, bearing, load):
        """Along the load: Palmgren with Q = 5 F / Z, and Gargiulo (1980), 0.0325e6 (D F Z^2)^(1/3) lb/in."""
        ball, n = bearing.ball_diameter, bearing.n_balls
        inch, pound = 0.0254, 4.448222
        gargiulo = (
            0.0325e6 * (ball / inch * load / pound * n**2) ** (1 / 3) * pound / inch
        )
        deflection = (
            1e-3 * 0.0020 * ((5 * load / n / 9.80665) ** 2 / (1e3 * ball)) ** (1 / 3)
        )
        _, along = bearing_stiffness(bearing, STEEL, load)
        assert_allclose(along, gargiulo, rtol=0.1, atol=0)
        assert_allclose(along, 1.5 * load / deflection, rtol=0.1, atol=0)

    @TIGHTER
    def test_it_grows_with_the_cube_root_of_the_load(self, bearing):
        one, other = (
            np.array(bearing_stiffness(bearing, STEEL, load)) for load in (50.0, 400.0)
        )
        assert_allclose(other / one, 2.0, rtol=1e-6, atol=0)
        loose = [
            bearing_stiffness(replace(bearing, radial_clearance=10e-6), STEEL, load)[0]
            for load in (50.0, 400.0)
        ]
        assert loose[1] / loose[0] > 2.2

    @pytest.mark.parametrize(
        "bearing", [SMALL, LARGE, LOOSE], ids=["6203", "6205", "loose"]
    )
    @LOADS
    def test_across_is_softer_than_along_without_preload(self, bearing, load):
        across, along = bearing_stiffness(bearing, STEEL, load)
        assert 0.0 < across < along

    def test_many_balls_without_clearance(self):
        """Half of the ring loaded by cos^1.5: across over along is (I_0.5 - I_2.5) / I_2.5 = 2/3, I_n of cos^n."""
        across, along = bearing_stiffness(
            replace(SMALL, n_balls=50, pitch_diameter=0.2), STEEL, 460.0
        )
        assert_allclose(across / along, 2 / 3, rtol=2e-3, atol=0)

    def test_a_symmetric_bearing_under_strong_preload_is_isotropic(self):
        across, along = bearing_stiffness(
            replace(SMALL, radial_clearance=-20e-6), STEEL, 1.0
        )
        assert_allclose(across, along, rtol=1e-4, atol=0)
        loaded = bearing_stiffness(
            replace(SMALL, radial_clearance=-20e-6), STEEL, 3000.0
        )
        assert abs(loaded[1] / loaded[0] - 1) > 0.02  # a load takes the symmetry away

    def test_more_clearance_is_softer_across(self):
        found = [
            bearing_stiffness(replace(SMALL, radial_clearance=p), STEEL, 460.0)[0]
            for p in (0.0, 5e-6, 20e-6)
        ]
        assert found[0] > found[1] > found[2]


class TestSupport:
    def test_a_stiff_shaft_leaves_two_bearings(self):
        stiff = replace(SHAFT, span=1e-3)
        two = 2 * np.array(bearing_stiffness(SMALL, STEEL, 460.0))
        assert_allclose(
            support_stiffness(SMALL, stiff, STEEL, 920.0), two, rtol=1e-3, atol=0
        )

    def test_a_slender_shaft_is_a_beam(self):
        slender = replace(SHAFT, span=0.6)
        beam = 48 * 206e9 * math.pi * 18e-3**4 / 64 / 0.6**3
        for value in support_stiffness(SMALL, slender, STEEL, 920.0):
            assert_allclose(value, beam, rtol=5e-3, atol=0)
            assert value < beam

    def test_in_series(self):
        across, along = bearing_stiffness(SMALL, STEEL, 460.0)
        bending = SHAFT.bending_stiffness(STEEL.youngs_modulus)
        found = support_stiffness(SMALL, SHAFT, STEEL, 920.0)
        expected = [2 * one * bending / (2 * one + bending) for one in (across, along)]
        assert_allclose(found, expected, rtol=1e-9, atol=0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"n_balls": 3}, "bearing.n_balls = 3 must lie in 5..60"),
        ({"ball_diameter": 0.0}, "bearing.ball_diameter_mm = 0 must be positive"),
        (
            {"pitch_diameter": 15e-3},
            "8 balls of this size touch each other; give more than 17.63",
        ),
        (
            {"inner_groove_conformity": 0.5},
            "bearing.inner_groove_conformity = 0.5 must lie in 0.505..0.6",
        ),
        (
            {"outer_groove_conformity": 0.7},
            "bearing.outer_groove_conformity = 0.7 must lie in 0.505..0.6",
        ),
        (
            {"radial_clearance": 2e-4},
            "bearing.radial_clearance_um = 200 must lie in -20..100",
        ),
    ],
)
def test_a_bearing_that_is_none(changes, text):
    with pytest.raises(ConfigError, match=re.escape(text)):
        replace(SMALL, **changes)


@pytest.mark.parametrize("key", ["diameter", "span"])
def test_a_shaft_that_is_none(key):
    with pytest.raises(ConfigError, match=f"shaft.{key}_mm = 0 must be positive"):
        replace(SHAFT, **{key: 0.0})
