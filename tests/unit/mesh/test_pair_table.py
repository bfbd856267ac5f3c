"""Tables of the mesh, and the options that choose them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError, ExtrapolationError
from gensig.faults.crack import Crack
from gensig.geometry.contact import corner_gap_by_pinion
from gensig.mesh.fillet_foundation import ExtrapolationWarning
from gensig.mesh.pair_table import pair_compliance, pair_table

# single pairs of the reference pair at A, B, C, D, E, 1e8 N/m (spur reference (docs/validation.md), table 2.2)
RC_MM = np.array([2.45827, 6.66082, 7.86646, 8.36253, 12.56508])
SINGLE_PAIR = np.array([1.5692, 2.0650, 2.0929, 2.0864, 1.5779])


def test_single_pair_stiffness_of_the_reference_pair(paper_machine):
    position = RC_MM * 1e-3 - paper_machine.pair.start_curvature_radius
    assert_allclose(1e-8 / pair_compliance(paper_machine.mesh_table(), position), SINGLE_PAIR, rtol=1e-3, atol=0)


def test_sound_teeth_have_the_corner_gap_and_nothing_else(xiamen):
    table = xiamen.mesh_table()
    expected = corner_gap_by_pinion(xiamen.pair, table.position)
    assert_allclose(table.pinion.gap[0] + table.wheel.gap[0], expected, rtol=0, atol=1e-15)
    assert table.pinion.kind.tolist() == [0] * 23
    assert table.wheel.kind.tolist() == [0] * 84


def test_slopes_are_those_of_the_tables(xiamen):
    table = xiamen.mesh_table()
    near = np.flatnonzero(table.pinion.gap[0] < 1e-3)
    here = slice(near[0], near[-1] + 1)
    step = np.diff(table.position[here])
    for key in ("compliance", "gap"):
        value, slope = getattr(table.pinion, key)[0, here], getattr(table.pinion, f"{key}_slope")[0, here]
        climbed = np.cumsum(0.5 * (slope[1:] + slope[:-1]) * step)
        # central differences miss up to half a cell's rise at the kinks, where a pair takes up and lets go of its load
        assert_allclose(climbed, value[1:] - value[0], rtol=0, atol=0.015 * np.ptp(value))


def test_only_the_faulty_tooth_has_its_own_row(xiamen):
    fault = Crack(gear="wheel", tooth=7, crack_depth=1e-3, crack_angle=0.8, crack_start="arc_mid")
    table = xiamen.mesh_table((fault,))
    assert np.flatnonzero(table.wheel.kind).tolist() == [7]
    assert not table.pinion.kind.any()
    assert len(table.wheel.compliance) == 2


def test_the_bodies_cannot_share_more_than_a_pair_has(xiamen):
    small = replace(xiamen.pair, pinion=replace(xiamen.pair.pinion, bore_radius=1e-3))
    options = replace(xiamen.mesh, body="sainsot", allow_extrapolation=True)
    with (
        pytest.raises(ExtrapolationError, match=r"share .* of the stiffest pair's"),
        pytest.warns(ExtrapolationWarning),
    ):
        pair_table(small, xiamen.material, options, load=1000.0)


def test_shared_compliance_only_when_coupled(xiamen, paper_machine):
    assert xiamen.mesh_table().shared_compliance > 1e-9
    assert paper_machine.mesh_table().shared_compliance == pytest.approx(0.0, abs=0.0)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("law", "papr", "mesh.law = 'papr'; allowed: one_sided, paper"),
        ("pair_coupling", "x", "mesh.pair_coupling = 'x'; allowed: coupled, sum"),
        ("roll_torque", "", "mesh.roll_torque = ''; allowed: consistent, classical"),
        ("damping_ratio", -0.1, "mesh.damping_ratio = -0.1 must lie in 0..1"),
        ("friction_coefficient", 0.9, "mesh.friction_coefficient = 0.9 must lie in 0..0.5"),
        ("friction_transition", 0.0, "mesh.friction_transition = 0 must lie in 0.001..0.5"),
        ("points_per_pitch", 3, "mesh.points_per_pitch = 3 must lie in 32..8192"),
    ],
)
def test_options_out_of_range(xiamen, key, value, text):
    with pytest.raises(ConfigError) as caught:
        replace(xiamen.mesh, **{key: value})
    assert str(caught.value) == text
