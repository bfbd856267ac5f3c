"""Literal eq. (14) of the thermal paper: components added up over the slices, then in series."""

import numpy as np
import pytest
from closeness import assert_close

from gensig.mesh.sliced.component_sum import (
    component_compliances,
    component_mesh_stiffness,
    component_pair_stiffness,
)
from gensig.mesh.sliced.slices import single_pair_stiffness
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

WORDS = (
    "system=helical_pair",
    "gear=chongqing_40_162",
    "mesh.law=paper",
    "mesh.pair_coupling=sum",
    "mesh.slice_coupling=independent",
    "mesh.allow_extrapolation=true",
)


def stiffness(contact, n_slices, *words):
    """Both stiffnesses of one pair along its way, (literal, slice by slice)."""
    options = f"mesh.contact={contact}", f"mesh.n_slices={n_slices}", *words
    flanks = PairParts(compose("generate", [*WORDS, *options])).cold_flanks
    position, by_slices = flanks.single_pair(101)
    mesh = flanks.sliced_mesh()
    components = component_compliances(mesh, flanks.material, None)
    at = mesh, components, position, flanks.mesh_force
    return component_pair_stiffness(*at), by_slices


@pytest.mark.parametrize("contact", ["linear", "weber"])
def test_one_slice_is_its_own_series(contact):
    literal, by_slices = stiffness(contact, 1, "mesh.slices_in_phase=true")
    assert by_slices.max() > 1e9
    assert_close(literal, by_slices, 1e-9, atol=1.0)


@pytest.mark.parametrize("contact", ["linear", "weber"])
def test_sums_of_components_are_never_softer(contact):
    """Cauchy's inequality; much stiffer where the slices are unlike, on a long contact line."""
    literal, by_slices = stiffness(contact, 30)
    assert np.all(literal >= by_slices * (1.0 - 1e-12))
    assert 1.02 < literal.max() / by_slices.max() < 1.15
    assert literal[[0, -1]] == pytest.approx(by_slices[[0, -1]], rel=0.01, abs=1e6)


def test_pairs_in_contact_add_up():
    flanks = PairParts(compose("generate", [*WORDS, "mesh.contact=linear"])).cold_flanks
    mesh = flanks.sliced_mesh()
    components = component_compliances(mesh, flanks.material, None)
    pitch, roll = flanks.pair.base_pitch, np.array([0.3, 0.8]) * flanks.pair.base_pitch
    force = flanks.mesh_force
    whole = component_mesh_stiffness(mesh, components, roll, force)
    pairs = [
        component_pair_stiffness(mesh, components, roll + number * pitch, force)
        for number in range(4)
    ]
    assert_close(whole, np.sum(pairs, axis=0), 1e-12)
    assert np.count_nonzero(np.array(pairs) > 0.0, axis=0).min() >= 2
    single_pair = single_pair_stiffness(mesh, roll, force)
    assert np.all(pairs[0] >= single_pair)
    assert_close(flanks.component_sums()[0].mean(), whole.mean(), 0.02)
