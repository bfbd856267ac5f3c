"""The load-dependent contact and plane strain: closed forms, laws, and the finite-element rows of
the reference.
"""

import numpy as np
import pytest
from closeness import assert_close

from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.local_contact import linear_contact, weber_contact

# spur reference, section 3.4: named points by pinion curvature radius (mm), pair in plane strain at
# 20 N m (1e8 N/m)
CURVATURE_MM = (
    2.45827,
    4.55954,
    6.66082,
    7.51168,
    7.86646,
    8.36253,
    10.46381,
    12.56508,
)
FINITE_ELEMENTS = (
    1.5067,
    1.7595,
    1.9036,
    1.9262,
    1.9291,
    1.9264,
    1.8218,
    1.5706,
)
LOCAL_PART = (
    1251.0,
    1177.5,
    1169.2,
    1163.5,
    1160.4,
    1155.1,
    1117.5,
    1058.9,
)  # 1e-12 m/N


@pytest.fixture(scope="module")
def physical(xiamen):
    """The default: ring body, tooth up to the centreline, Weber's contact, plane strain."""
    return xiamen


def positions(system):
    return np.clip(
        np.array(CURVATURE_MM) * 1e-3 - system.pair.start_curvature_radius,
        0.0,
        system.pair.path_of_contact,
    )


def single_pair(system):
    curves = system.stiffness_curves()
    return np.interp(
        positions(system) / system.pair.base_pitch,
        curves.contact_position,
        curves.single_pair_stiffness,
    )


def test_single_pair_against_finite_elements(physical):
    assert_close(
        single_pair(physical),
        np.array(FINITE_ELEMENTS) * 1e8,
        0.015,
    )


def test_local_part_against_finite_elements(physical):
    at = positions(physical)
    width = physical.pair.pinion.face_width
    load = physical.mesh_force
    result = weber_contact(physical.pair, at, physical.material).compliance(width, load)

    assert np.all(
        (result / (np.array(LOCAL_PART) * 1e-12) > 0.90)
        & (result / (np.array(LOCAL_PART) * 1e-12) < 0.95)
    )
    assert (
        linear_contact(at, physical.material).compliance(width, load)[0]
        < 0.3 * result.min()
    )


def test_coupled_double_zone_against_finite_elements(physical):
    """Section 3.4: coupled with local contact at 20 N m, plane stress times 1.04."""
    along_mm = np.array([0.0, 0.7, 1.401, 2.101, 2.802, 3.502, 4.203])
    expected = np.array([2.355, 2.386, 2.403, 2.408, 2.401, 2.381, 2.347]) * 1e8 * 1.04
    table = physical.mesh_table()
    result = static_mesh(
        table,
        pair_states(table, along_mm * 1e-3),
        physical.mesh_force,
    ).stiffness

    assert_close(result, expected, 0.01)


def test_local_compliance_falls_with_load_and_width(physical):
    law = weber_contact(
        physical.pair,
        np.full(4, physical.pair.pitch_point),
        physical.material,
    )
    width = physical.pair.pinion.face_width
    assert np.all(
        np.diff(law.compliance(width, np.array([50.0, 200.0, 900.0, 4000.0]))) < 0
    )
    assert np.all(
        np.diff(law.compliance(width * np.array([0.25, 0.5, 0.75, 1.0]), 900.0)) < 0
    )


def test_load_sharing_and_compliance_agree(physical):
    """The table's contact term belongs to the loads that the table itself gives: a fourth round
    changes nothing.
    """
    table = physical.mesh_table()
    force = physical.mesh_force
    roll = physical.pair.base_pitch * (np.arange(40) + 0.5) / 40
    states = pair_states(table, roll)
    load = static_mesh(table, states, force).load
    inside = (
        (states.position > 0)
        & (states.position < physical.pair.path_of_contact)
        & (load > 0.1 * force)
    )
    at = states.position[inside]
    width = physical.pair.pinion.face_width
    of_pairs = states.compliance[inside, 0] + table.shared_compliance
    law = weber_contact(physical.pair, at, physical.material)
    contact = law.compliance(width, load[inside])
    full = law.compliance(width, force)
    curves = physical.stiffness_curves()
    alone = 1.0 / np.interp(
        at / physical.pair.base_pitch,
        curves.contact_position,
        curves.single_pair_stiffness,
    )

    assert_close(of_pairs - contact, alone - full, 2e-3)


def test_plane_strain_is_plane_stress_of_another_material(xiamen):
    material = xiamen.material
    inside = material.in_plane("plane_strain")
    assert_close(
        inside.youngs_modulus,
        material.youngs_modulus / 0.91,
        1e-12,
    )
    assert_close(inside.shear_modulus, material.shear_modulus, 1e-12)
    assert material.in_plane("plane_stress") is material
