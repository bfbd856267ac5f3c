"""Loaded contact in slices: equilibrium, the spur pair as its special case, bounds, and the figures
of both papers.
"""

import math

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused
from scipy.linalg import block_diag
from scipy.optimize import nnls

from gensig.errors import GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import healthy_tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material
from gensig.mesh.body_coupling import cross_compliance
from gensig.mesh.load_distribution import (
    loaded_pair_table,
    pair_states,
    static_mesh,
)
from gensig.mesh.options import read_mesh_options, read_slice_options
from gensig.mesh.pair_table import structural_compliance
from gensig.mesh.sliced._slice_kernels import bite_forces
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import loaded_contact, sliced_mesh
from gensig.options.compose import compose
from gensig.units import read, to_si

STEEL = Material(
    youngs_modulus=210e9,
    poisson_ratio=0.3,
    density_kg_per_m3=7850.0,
)
REFERENCE = {
    "pair_coupling": "sum",
    "contact": "linear",
    "law": "paper",
    "allow_extrapolation": True,
}
BODY = ("mass_kg", "inertia_kg_m2", "support", "bearing", "shaft")


@pytest.fixture(scope="module")
def mesh_keys():
    return compose("generate", [])["mesh"]


def gears(name, **changes):
    """A pair of a configuration, keys of both gears changed."""
    config = compose("generate", [f"gear={name}"])["gear"]
    sides = {}
    for side, hand in (("pinion", 1.0), ("wheel", -1.0)):
        keys = {key: value for key, value in config[side].items() if key not in BODY}
        for key in (
            "normal_module_mm",
            "pressure_angle_deg",
            "addendum_coefficient",
            "clearance_coefficient",
            "cutter_tip_radius_coefficient",
        ):
            keys[key] = config[key]
        keys["helix_angle_deg"] = hand * config["helix_angle_deg"]
        values = keys | {
            key: hand * value if key == "helix_angle_deg" else value
            for key, value in changes.items()
        }
        sides[side] = read(Gear, values, side, name=side)
    return GearPair(
        **sides,
        backlash=to_si("backlash_um", config["backlash_um"]),
    )


def solved(pair, torque, keys, *, n_phases=64, deviation=None, **changes):
    """Mesh and contact over one pitch under a pinion torque."""
    values = keys | {"slice_coupling": "independent"} | changes
    mesh = sliced_mesh(
        pair,
        STEEL,
        read_mesh_options(values),
        read_slice_options(values),
        deviation=deviation,
    )
    roll = pair.base_pitch * (np.arange(n_phases) + 0.5) / n_phases
    return mesh, loaded_contact(mesh, roll, torque / pair.pinion.base_radius)


@pytest.mark.parametrize("coupling", ["independent", "coupled"])
@pytest.mark.parametrize(
    "changes",
    [
        {"contact": "linear", "pair_coupling": "sum"},
        {"contact": "linear"},
        {},
    ],
)
def test_spur_is_the_same_code_with_zero_helix(mesh_keys, coupling, changes):
    pair = gears("xiamen_23_84")
    options = read_mesh_options(mesh_keys | changes)
    _, contact = solved(
        pair,
        20.0,
        mesh_keys | changes,
        slice_coupling=coupling,
        n_slices=7,
    )
    force = 20.0 / pair.pinion.base_radius
    table = loaded_pair_table(pair, STEEL, options, force=force)
    static = static_mesh(table, pair_states(table, contact.roll), force)
    # the spur table takes its secant at a load found in rounds, and smooths its nodes
    share = 1e-4 if "contact" in changes else 2e-3

    assert_close(contact.approach, static.approach, share)
    assert_close(contact.stiffness, static.stiffness, share)
    assert np.ptp(contact.line_load, axis=2).max() < 1e-6 * contact.line_load.max()


def flexibility(structure, coupling, local):
    """Deflections of a tooth pair's slices by their line loads, (slice, slice)."""
    between = 2.0 * coupling / (structure[1:] + structure[:-1])
    steps = np.diff(np.eye(len(structure)), axis=0)
    stiffness = np.diag(1.0 / structure) + steps.T @ np.diag(between) @ steps
    return np.linalg.inv(stiffness) + np.diag(local)


@pytest.mark.parametrize("length", [0.0, 0.5, 2.0])
def test_equilibrium_is_that_of_an_independent_solver(mesh_keys, length):
    """Non-negative least squares on the dense compliance matrix of the same slices."""
    pair = gears("beihang_61_132")
    changes = {
        "contact": "linear",
        "slice_coupling": "coupled",
        "coupling_modules": length,
        "n_slices": 12,
        "deviation": np.linspace(0.0, 8e-6, 12)[:, None],
    }
    mesh, contact = solved(pair, 60.0, mesh_keys, n_phases=3, **changes)
    force = 60.0 / pair.pinion.base_radius
    coupling = (length * pair.pinion.normal_module / mesh.slice_width[0]) ** 2

    for k, position in enumerate(contact.position):
        structure = np.interp(position, mesh.position, mesh.structure)
        constant = np.interp(position, mesh.position, mesh.contact_constant)
        local = mesh.contact_factor * constant
        gap = [
            np.interp(at, mesh.position, row, left=1.0, right=1.0)
            for at, row in zip(position.T, mesh.gap, strict=True)
        ]
        blocks = [
            flexibility(structural, coupling, soft)
            for structural, soft in zip(structure, local, strict=True)
        ]
        # min 1/2 p'Cp - (approach - gap)'p over p >= 0, as least squares with the root of C
        root = np.linalg.cholesky(block_diag(*blocks)).T
        within = contact.approach[k] - mesh.shared_compliance * force
        reach = within - np.transpose(gap).ravel()
        load, _ = nnls(root * 1e6, np.linalg.solve(root.T, reach) * 1e6)
        assert_close(
            contact.line_load[k].ravel(),
            load,
            atol=2e-6 * load.max(),
        )


@pytest.mark.parametrize(
    ("first", "last", "is_loaded", "finite_elements"),
    [
        (5e-3, 15e-3, True, 1.27),
        (5e-3, 15e-3, False, 1.27),
        (0.0, 10e-3, True, 1.48),
    ],
    ids=["middle half", "outer halves", "one end"],
)
def test_coupling_length_is_that_of_finite_elements(
    mesh_keys, first, last, is_loaded, finite_elements
):
    """Softening of the spur paper's pinion (20 mm wide) when a straight mate touches half of
    its face only.

    Three-dimensional finite elements (tests/reference) against the default coupling over what
    bodies do not share.
    """
    pair = gears("xiamen_23_84")
    options = read_mesh_options(mesh_keys)
    in_plane = STEEL.in_plane(options.elasticity)
    tooth = healthy_tooth(pair.pinion)
    curvature = np.array([float(pair.pinion_curvature(pair.pitch_point))])
    whole = structural_compliance(tooth, curvature, in_plane, options)[0]
    overlap = np.linspace(0.0, pair.path_of_contact - pair.base_pitch, 9)
    angles = [
        load_angle(pair.pinion, np.asarray(pair.pinion_curvature(at)))
        for at in (overlap, overlap + pair.base_pitch)
    ]
    shared = float(np.mean(cross_compliance(pair.pinion, in_plane, *angles, pitches=1)))

    n = 200
    place = (np.arange(n) + 0.5) / n * 20e-3
    inside = (place > first) & (place < last)
    gap = np.where(inside == is_loaded, 0.0, 1.0)[None]
    width = np.full((1, n), 20e-3 / n)
    structure = np.full((1, n), (whole - shared) * 20e-3)
    modules = read_slice_options(mesh_keys).coupling_modules
    coupling = (modules * pair.pinion.normal_module) ** 2
    depth = np.array([1e-6])
    touch = np.empty(1)
    force = np.empty((1, 1))
    bite_forces(
        structure,
        1e-6 * structure[0, 0],
        np.ones((1, n)),
        0.0,
        gap,
        width,
        width[0],
        coupling,
        1.0,
        depth,
        1.0,
        touch,
        force,
    )
    softer = (depth[0] / force[0, 0] + shared) / whole

    assert_close(softer, finite_elements, 0.03)


def test_an_overlap_of_one_has_no_ripple(mesh_keys):
    pair = gears("beihang_61_132")
    width = math.pi * pair.pinion.normal_module / math.sin(abs(pair.pinion.helix_angle))
    pair = gears("beihang_61_132", face_width_mm=width * 1e3)

    assert_close(pair.overlap_ratio, 1.0, atol=1e-12)

    for keys in (mesh_keys, mesh_keys | REFERENCE):
        assert np.ptp(solved(pair, 178.0, keys)[1].approach) < 1e-8


def test_results_settle_with_more_slices(mesh_keys):
    pair = gears("beihang_61_132")
    for keys in (mesh_keys, mesh_keys | REFERENCE):
        coarse, fine, finest = (
            solved(pair, 178.0, keys, n_slices=n)[1] for n in (10, 40, 160)
        )
        for of in (
            lambda c: c.approach.mean(),
            lambda c: np.ptp(c.approach),
            lambda c: c.line_load.max(),
        ):
            assert abs(of(fine) - of(finest)) < 0.5 * abs(
                of(coarse) - of(finest)
            ) + 1e-9 * abs(of(finest))


def test_contact_pressure_is_that_of_a_cylinder_on_a_cylinder(mesh_keys):
    """Textbook: p = sqrt(F E' / (2 pi rho L)), all in the normal section."""
    pair = gears("beihang_61_132")
    mesh, contact = solved(pair, 178.0, mesh_keys | REFERENCE)
    pressure = contact_pressure(mesh, contact, STEEL)
    k, i, j = np.unravel_index(np.argmax(contact.line_load), contact.line_load.shape)
    position = contact.position[k, i, j]
    slant = math.cos(pair.base_helix_angle)
    radii = [
        float(pair.pinion_curvature(position)) / slant,
        float(pair.wheel_curvature(position)) / slant,
    ]
    radius = radii[0] * radii[1] / sum(radii)
    normal_load_per_length = (
        contact.line_load[k, i, j] / slant * slant
    )  # normal force up, contact line longer
    expected = math.sqrt(
        normal_load_per_length * 210e9 / (1 - 0.3**2) / (2 * math.pi * radius)
    )

    assert_close(pressure[k, i, j], expected, 1e-12)


def test_no_contact_is_refused(mesh_keys):
    pair = gears("beihang_61_132")
    with refused("must be positive"):
        solved(pair, 0.0, mesh_keys)
    with refused("no contact", GeometryError):
        solved(
            pair,
            178.0,
            mesh_keys,
            deviation=np.full((40, 1), np.inf),
        )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("n_slices", 0),
        ("coupling_modules", -1.0),
        ("slice_coupling", "glued"),
    ],
)
def test_slices_that_make_no_sense_are_refused(mesh_keys, key, value):
    with refused(f"mesh.{key} = "):
        read_slice_options(mesh_keys | {key: value})
