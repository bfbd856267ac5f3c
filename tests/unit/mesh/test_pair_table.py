"""Tables of the mesh, and the options that choose them."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import GEARS, KINDS, on_path, one, side_of
from refusals import given, refused

from gensig import load_faults
from gensig.errors import ConfigError, ExtrapolationError
from gensig.faults.base import faulty_teeth
from gensig.geometry.contact import corner_gap_by_pinion
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.fillet_foundation import ExtrapolationWarning
from gensig.mesh.load_distribution import sound_load
from gensig.mesh.local_contact import contact_law
from gensig.mesh.pair_table import flank_sides, pair_table, slice_bending


def test_softer_teeth_share_the_load_in_another_way(xiamen):
    system = xiamen
    soft = replace(system.material, youngs_modulus=0.1 * system.material.youngs_modulus)
    loads = [
        sound_load(system.pair, material, system.mesh, 1000.0)
        for material in (system.material, soft)
    ]
    assert np.abs(loads[0] - loads[1]).max() > 1.0


def test_sound_teeth_have_the_corner_gap_and_nothing_else(xiamen):
    table = xiamen.mesh_table()
    expected = corner_gap_by_pinion(xiamen.pair, table.position)
    near = expected < 1e-4
    # the parabolas of the table cut that much off where the gap begins
    gap = table.pairs.gap[0, 0, 0]

    assert_close(gap[near], expected[near], atol=5e-9)
    assert table.pinion.kind.tolist() == [0] * 23
    assert table.wheel.kind.tolist() == [0] * 84


def test_slopes_are_those_of_the_tables(xiamen):
    """Between nodes the slope goes straight and the value follows it."""
    table = xiamen.mesh_table((one("pitting", tooth=0),))
    step = np.diff(table.position)
    for key in ("compliance", "gap"):
        values = getattr(side_of(table, "pinion"), key)
        slopes = getattr(side_of(table, "pinion"), f"{key}_slope")
        climbed = np.cumsum(0.5 * (slopes[:, 1:] + slopes[:, :-1]) * step, axis=1)
        expected = values[:, 1:] - values[:, :1]
        atol = 1e-12 * np.ptp(values)
        assert_close(climbed, expected, atol=atol)


class TestFlankSides:
    """The contact term of a pair is counted once, however it is split between the gears."""

    @staticmethod
    def contact(system, share, **faults):
        """Contact compliance of the pair along the path, (phase,) m/N, by gears' faults."""
        at = np.linspace(0.0, system.pair.path_of_contact, 9)
        mesh = system.pair, at, system.material, system.mesh
        sides = flank_sides(*mesh, system.mesh_force, pinion_share=share)
        teeth = faulty_teeth(system.pair, faults.values())
        total = 0.0
        for name, side in sides.items():
            tooth = teeth.get((name, 0), healthy_tooth(side.gear))
            total = total + side.contact(tooth, slice_bending(*mesh), system.mesh)[1]
        return total, contact_law(*mesh)

    @pytest.mark.parametrize("contact", ["linear", "weber"])
    @pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
    def test_sound_flanks_make_the_law(self, machine, contact, share):
        system = machine({"mesh.contact": contact})
        total, law = self.contact(system, share)
        expected = law.compliance(20e-3, system.mesh_force)
        assert_close(total, expected, 1e-12)

    @pytest.mark.parametrize("gear", GEARS)
    @pytest.mark.parametrize("bending", ["whole", "by_slice"])
    def test_the_split_is_nothing_for_faulty_ones(self, machine, gear, bending):
        system = machine({"mesh.bending": bending})
        chip = {
            "chip_width_mm": 10,
            "chip_shape": "rectangular",
            "chip_height_mm": 3,
        }
        fault = {gear: one("chipped", gear=gear, **chip)}
        totals = [self.contact(system, share, **fault)[0] for share in (0.0, 0.5, 1.0)]
        for total in totals[1:]:
            assert_close(total, totals[0], 1e-12)
        sound, law = self.contact(system, 0.5)
        # at most half of the face is lost: the law at half the width, the slices' bending twice
        at = np.linspace(0.0, system.pair.path_of_contact, 9)
        more = slice_bending(system.pair, at, system.material, system.mesh)
        most = law.compliance(10e-3, system.mesh_force) + more

        assert np.all(totals[0] <= most * (1 + 1e-4))
        assert_close((totals[0] / most).max(), 1.0, 1e-3)
        assert_close((totals[0] / sound).min(), 1.0, 1e-9)

    def test_the_flank_goes_on_beyond_its_tip(self, xiamen):
        at = xiamen.pair.path_of_contact * np.array([-0.2, 0.5, 1.2])
        sides = flank_sides(xiamen.pair, at, xiamen.material, xiamen.mesh, 900.0)
        for name, low, high in (
            ("pinion", 0, 2),
            ("wheel", 2, 0),
        ):
            side = sides[name]
            tip = healthy_tooth(side.gear).profile.curvature_radius[-1]
            assert_close(side.curvature.max(), tip, 1e-9)
            center = side.contacts.center[side.contacts.of_phase]
            curvature = np.sqrt(2.0 * side.gear.base_radius * center)
            assert curvature[high] > tip * 1.05
            result, expected = (
                values[[low, 1]] for values in (curvature, side.curvature)
            )
            assert_close(result, expected, 1e-12)


# Share of the largest gap that a line between nodes may miss: a rough flank has many kinks.
BETWEEN_NODES = {"surface_damage": 1e-2}


class TestRows:
    @pytest.mark.parametrize("gear", GEARS)
    @pytest.mark.parametrize("kind", KINDS)
    def test_curves_and_tables_agree(self, xiamen, kind, gear):
        """The gap of the faulty pair by ``stiffness_curves`` and by the table."""
        fault = one(kind, gear=gear, tooth=0)
        table = xiamen.mesh_table((fault,))
        curves = xiamen.stiffness_curves((fault,), points_per_tooth=1)
        side = side_of(table, gear)
        at = curves.contact_position * xiamen.pair.base_pitch
        expected = np.interp(
            at,
            table.position,
            side.gap[side.kind[0]] - side.gap[0],
        )
        # linear between nodes, whose parabolas round off steps, against the value itself
        atol = 2e-9 + BETWEEN_NODES.get(kind, 3e-3) * np.abs(expected).max()

        assert_close(curves.faulty_pair_gap, expected, atol=atol)
        assert np.all(np.isfinite(side.compliance))
        assert side.compliance.min() > 0
        assert np.isfinite(side.gap[:, on_path(table)]).all()


def test_the_bodies_cannot_share_more_than_a_pair_has(xiamen):
    small = replace(
        xiamen.pair,
        pinion=replace(xiamen.pair.pinion, bore_radius=1e-3),
    )
    options = replace(xiamen.mesh, body="sainsot", allow_extrapolation=True)
    with (
        pytest.raises(
            ExtrapolationError,
            match=r"share .* of the stiffest pair's",
        ),
        pytest.warns(ExtrapolationWarning),
    ):
        pair_table(small, xiamen.material, options, load=1000.0)


def test_shared_compliance_only_when_coupled(xiamen, paper_machine):
    assert xiamen.mesh_table().shared_compliance > 1e-9
    assert_close(paper_machine.mesh_table().shared_compliance, 0.0)


OUT_OF_RANGE = {
    "law='papr'": "mesh.law = 'papr'; allowed: one_sided, paper",
    "pair_coupling='x'": "mesh.pair_coupling = 'x'; allowed: coupled, sum",
    "crack='x'": "mesh.crack = 'x'; allowed: calibrated, paper",
    "bending='x'": "mesh.bending = 'x'; allowed: by_slice, whole",
    "roll_torque=''": "mesh.roll_torque = ''; allowed: consistent, classical",
    "phase='x'": "mesh.phase = 'x'; allowed: rotation, prescribed",
    "damping_ratio=-0.1": "mesh.damping_ratio = -0.1 must lie in 0..1",
    "friction_coefficient=0.9": "mesh.friction_coefficient = 0.9 must lie in 0..0.5",
    "friction_transition=0.0": "mesh.friction_transition = 0 must lie in 0.001..0.5",
    "points_per_pitch=3": "mesh.points_per_pitch = 3 must lie in 32..8192",
}


@pytest.mark.parametrize(("change", "text"), OUT_OF_RANGE.items())
def test_options_out_of_range(xiamen, change, text):
    with pytest.raises(ConfigError) as caught:
        replace(xiamen.mesh, **given(change))
    assert str(caught.value) == text


def test_a_prescribed_phase_goes_with_the_papers_law(xiamen):
    text = "mesh.phase = prescribed goes with mesh.law = paper, not one_sided"
    with refused(text):
        replace(xiamen.mesh, phase="prescribed")
    assert replace(xiamen.mesh, law="paper", phase="prescribed").phase == "prescribed"


def test_the_faulty_pair_of_the_curves_is_that_of_the_first_fault(xiamen):
    crack = load_faults("fault=crack", "fault.tooth=5")
    both = xiamen.stiffness_curves(
        (*crack, *load_faults("fault=pitting", "fault.tooth=2"))
    )
    alone = xiamen.stiffness_curves(crack)
    assert_close(both.faulty_pair_stiffness, alone.faulty_pair_stiffness)
