"""Tooth, contact and body compliance against closed forms and the reference table."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import one
from scipy.integrate import quad

from gensig.errors import ExtrapolationError
from gensig.faults.base import faulty_teeth
from gensig.geometry.tooth import healthy_tooth
from gensig.geometry.tooth_profile import (
    involute_point,
    load_angle,
    tooth_profile,
)
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.fillet_foundation import ExtrapolationWarning, body_coefficients

# pinion at B, C and E, 1e-12 m/N (spur reference (docs/validation.md), table 2.2)
CURVATURE = np.array([6.66082e-3, 7.86646e-3, 12.56508e-3])


def test_running_sums_equal_direct_quadrature(xiamen):
    """The expanded moment arm against eq. (3) integrated as it stands, on the true outline."""
    gear = xiamen.pair.pinion
    material = xiamen.material
    fine = tooth_profile(gear, n_root_cells=4000, n_flank_cells=4000)
    rho = np.array([9e-3])
    angle = load_angle(gear, rho)[0]
    (x_load,), (h_load,) = involute_point(gear, rho)

    def integrand(x):
        half = np.interp(x, fine.abscissa, fine.half_thickness)
        moment = math.cos(angle) * (x_load - x) - math.sin(angle) * h_load
        section = (2 * half) ** 3 * gear.face_width / 12
        return moment**2 / (material.youngs_modulus * section)

    knee = fine.abscissa[fine.n_root_cells]
    expected, _ = quad(
        integrand,
        fine.abscissa[0],
        x_load,
        points=[knee],
        limit=400,
    )
    result = tooth_compliance(healthy_tooth(gear), rho, material).bending

    assert_close(result, expected, 1e-4)


@pytest.mark.parametrize("term", ["bending", "shear", "axial"])
def test_quadrature_is_converged(xiamen, term):
    gear = xiamen.pair.wheel
    rho = np.linspace(gear.junction_curvature_radius + 1e-3, 33e-3, 9)

    def computed(n):
        profile = tooth_profile(gear, n_root_cells=n, n_flank_cells=3 * n // 2)
        tooth = healthy_tooth(gear, profile)
        return getattr(tooth_compliance(tooth, rho, xiamen.material), term)

    fine = computed(1024)

    assert_close(computed(256), fine, 2e-4, atol=1e-4 * fine.max())


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_compliance_scales_with_modulus_and_width(xiamen, factor):
    gear = xiamen.pair.pinion
    material = xiamen.material
    stiff = replace(material, youngs_modulus=factor * material.youngs_modulus)
    wide = replace(gear, face_width=factor * gear.face_width)
    base, stiffer, wider = (
        tooth_compliance(healthy_tooth(body), CURVATURE, steel).total
        for body, steel in (
            (gear, material),
            (gear, stiff),
            (wide, material),
        )
    )

    assert_close(stiffer, base / factor, 1e-12)
    assert_close(wider, base / factor, 1e-12)


class TestRangeOfTheBodyFit:
    def test_silent_where_it_was_checked(self, xiamen):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            body_coefficients(xiamen.pair.pinion, allow_extrapolation=False)

    def test_warned_where_only_plausible(self, gear_with):
        with pytest.warns(ExtrapolationWarning, match="theta_f = 0.1"):
            body_coefficients(gear_with(n_teeth=18), allow_extrapolation=False)

    @pytest.mark.parametrize("bore", [1e-3, 17e-3])
    def test_refused_beyond_unless_allowed(self, gear_with, bore):
        gear = gear_with(bore_radius=bore)
        with pytest.raises(
            ExtrapolationError,
            match=r"pinion: root radius over bore radius h_f .*bore_radius_mm",
        ):
            body_coefficients(gear, allow_extrapolation=False)
        with pytest.warns(ExtrapolationWarning):
            assert body_coefficients(gear, allow_extrapolation=True)


def test_a_crack_softens_its_tooth_unless_its_sections_are_left_whole(xiamen):
    crack = one("crack", tooth=0, crack_depth_mm=1.0)
    pair, material = xiamen.pair, xiamen.material
    cracked = faulty_teeth(pair, (crack,))[("pinion", crack.tooth)]

    def total(tooth, **options):
        return tooth_compliance(tooth, CURVATURE, material, **options).total

    sound = total(healthy_tooth(pair.pinion))
    assert (total(cracked) > 1.01 * sound).all()
    assert_close(total(cracked, papers_crack=False), sound, 1e-12)
