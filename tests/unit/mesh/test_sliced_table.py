"""Chords of the force of sliced pairs: the same equilibrium as the slices, the spur table, convex
and within 1 %.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig import load_faults
from gensig.errors import FaultError
from gensig.mesh import pair_table
from gensig.mesh.load_distribution import (
    PERFECT,
    Meeting,
    loaded_pair_table,
    pair_states,
    static_mesh,
)
from gensig.mesh.sliced import sliced_table
from gensig.mesh.sliced.sliced_table import DEEPEST, N_CHORDS
from gensig.mesh.sliced.slices import (
    loaded_contact,
    single_pair_stiffness,
)
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair


@cache
def table_of(*words):
    """A system, its table under its torque, and its sliced mesh."""
    system = read_sliced_pair(read_request(["system=helical_pair", *words]).config)
    return system, system.mesh_table(), system.sliced_mesh()


def faults_of(*words):
    return load_faults("system=helical_pair", *words)


def at_rest(table, roll, force, meeting=PERFECT):
    """Approach and load (phase, pair) of the chords under a total force."""
    static = static_mesh(table, pair_states(table, roll, meeting), force)
    return static.approach, static.load


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("gear=chongqing_40_162",),
        (
            "mesh.contact=linear",
            "mesh.slice_coupling=independent",
            "mesh.pair_coupling=sum",
        ),
        (
            "modification=beihang_both",
            "modification.misalignment_um=15",
        ),
        ("gear=xiamen_23_84",),
        ("mesh.n_slices=160",),
    ],
)
@pytest.mark.parametrize("part", [0.5, 1.0, 2.5])
def test_equilibrium_is_that_of_the_slices(words, part):
    """Under a part of the set force."""
    system, table, mesh = table_of(*words)
    roll = system.phases(32)
    force = part * system.mesh_force

    exact = loaded_contact(mesh, roll, force)
    approach, load = at_rest(table, roll, force)

    assert_close(approach, exact.approach, 5e-3 / min(part, 1.0))

    ripple = np.ptp(exact.approach)
    most = 0.1 * ripple + 2e-3 * exact.approach.mean()
    assert np.ptp(approach - exact.approach) < most

    # newest first in both; the table may have fewer pairs
    expected = (exact.line_load * mesh.slice_width).sum(axis=2)
    behind = max(load.shape[1] - expected.shape[1], 0)
    expected = expected[:, : load.shape[1]]

    assert_close(load[:, behind:], expected, atol=0.012 * force)


@pytest.mark.parametrize(("n_slices", "share"), [(6, 0.5), (20, 0.1)])
def test_few_slices_that_enter_over_their_width_are_many(n_slices, share):
    """The table has the ripple of 160 slices; as few slices that enter whole do not."""
    system, table, few = table_of(f"mesh.n_slices={n_slices}")
    _, _, finest = table_of("mesh.n_slices=160")
    roll = system.phases(32)
    force = system.mesh_force

    many = loaded_contact(finest, roll, force).approach
    chords, _ = at_rest(table, roll, force)
    whole = loaded_contact(few, roll, force).approach

    error = np.ptp(chords - many)

    assert error < share * np.ptp(many)
    assert error < 0.4 * np.ptp(whole - many)


@pytest.mark.parametrize(
    ("fault", "share"),
    [
        (
            (
                "fault=crack",
                "fault.crack_depth_mm=1",
                "fault.crack_width_mm=5",
            ),
            2e-3,
        ),
        (
            (
                "fault=pitting",
                "fault.pit_length_mm=0.6",
                "fault.pit_width_mm=5",
            ),
            2e-3,
        ),
        (("fault=chipped",), 2e-3),
        (("fault=broken", "fault.broken_height_mm=1"), 3e-3),
        (("fault=missing_tooth",), 2e-3),
        (("fault=pitch_error",), 2e-3),
        (("fault=wear",), 5e-3),
        (("fault=misalignment",), 0.01),
    ],
)
def test_faulty_teeth_have_their_own_chords(fault, share):
    """Over the mesh periods in which tooth 0 meets sound teeth."""
    system = table_of()[0]
    faults = faults_of(*fault)
    table = system.mesh_table(faults)
    roll = system.phases(16, first_period=-2, n_periods=8)
    exact = loaded_contact(system.sliced_mesh(faults), roll, system.mesh_force)
    approach, _ = at_rest(table, roll, system.mesh_force)

    assert_close(approach, exact.approach, share)
    assert len(table.pinion.present) == 2
    assert len(table.wheel.present) == 1

    sound = at_rest(system.mesh_table(), roll, system.mesh_force)[0]
    assert np.abs(exact.approach - sound).max() > 2.0 * share * sound.max()


def test_errors_of_single_teeth_open_all_chords():
    """Pitch errors and tilts of a grade 5 gear; the table takes tilts at mid-face."""
    system, table, mesh = table_of()
    rng = np.random.default_rng(2)
    errors, tilts = (
        tuple(rng.uniform(-most, most, n) for n in (61, 132)) for most in (2e-6, 1e-4)
    )
    meeting = Meeting(errors=errors, tilts=tilts)
    roll = system.phases(16, n_periods=20)
    force = system.mesh_force

    exact = loaded_contact(mesh, roll, force, meeting).approach
    result, _ = at_rest(table, roll, force, meeting)

    assert_close(result, exact, 5e-3)
    assert np.ptp(exact) > 1e-6


def test_teeth_that_all_share_a_form_are_computed_once():
    """Sound teeth that nothing meets stay kind 0, for the back flanks."""
    system, _, _ = table_of()
    form = replace(faults_of("fault=profile_error")[0], tooth="all")
    crack = faults_of("fault=crack", "fault.crack_depth_mm=1", "fault.tooth=3")
    table = system.mesh_table((form, *crack))

    assert table.pairs.compliance.shape[:2] == (3, 1)
    assert table.pinion.kind[3] == 2
    assert np.bincount(table.pinion.kind).tolist() == [0, 60, 1]

    again = system.mesh_table((form,))
    np.testing.assert_array_equal(
        again.pairs.compliance[1, 0], table.pairs.compliance[1, 0]
    )
    np.testing.assert_array_equal(again.depth, table.depth)
    assert system.mesh_table((form,)) is again


def test_too_many_different_teeth_are_refused():
    system = table_of()[0]
    (runout,) = faults_of("fault=runout")
    message = "62 different teeth of the pinion and 133 of the wheel make 8246 pairs"
    with refused(message, FaultError):
        system.mesh_table((runout, replace(runout, gear="wheel")))


def test_chords_are_convex_and_meet():
    system, table, _ = table_of()
    force = system.mesh_force
    assert len(table.depth) == N_CHORDS
    assert table.depth[0] == 0.0

    compliance = table.pairs.compliance[0, 0] - table.shared_compliance
    gap = table.pairs.gap[0, 0]
    near = gap[0] < 20e-6

    assert (np.diff(compliance[:, near], axis=0) < 1e-4 * compliance[1:, near]).all()

    met = gap[0] + table.depth[1:, None]
    before = (met - gap[:-1]) / compliance[:-1]
    after = (met - gap[1:]) / compliance[1:]

    assert_close(before[:, near], after[:, near], atol=2e-3 * force)

    # deep enough for three times the load, and the set chord holds the mean load
    contact = loaded_contact(system.sliced_mesh(), system.phases(64), force)
    static = contact.approach.max() - table.shared_compliance * force
    assert 0.6 * DEEPEST * static < table.depth[-1] < DEEPEST * static
    assert 0 < table.set_chord < N_CHORDS


def test_ends_are_out_of_reach():
    for words in (
        (),
        ("gear=xiamen_23_84",),
        ("gear=chongqing_40_162",),
    ):
        _, table, _ = table_of(*words)
        pitch = table.pair.base_pitch
        assert_close(table.position[0], table.first_pitch * pitch, 1e-6)
        assert_close(table.position[-1], table.last_pitch * pitch, 1e-6)
        assert table.pairs.gap[0, 0, 0, [0, -1]].min() > 90e-6
        assert np.isfinite(table.pairs.compliance).all()
        assert np.isfinite(table.pairs.gap).all()


def test_slopes_are_those_of_the_values():
    _, table, _ = table_of()
    distance = table.position[1] - table.position[0]
    for values, slopes in (
        (table.pairs.compliance, table.pairs.compliance_slope),
        (table.pairs.gap, table.pairs.gap_slope),
    ):
        step = 0.5 * distance * (slopes[..., 1:] + slopes[..., :-1])
        atol = 1e-9 * np.abs(values).max()
        assert_close(np.diff(values, axis=3), step, atol=atol)


def test_steps_are_smoothed_without_ringing(monkeypatch):
    """A node is the mean with its neighbours, but for a quarter of the clipped correction."""
    system, table, _ = table_of()
    monkeypatch.setattr(
        sliced_table, "smooth", lambda values, *_: (values, np.zeros_like(values))
    )
    plain = sliced_table.sliced_table(
        system.pair,
        system.material,
        system.mesh,
        system.slices,
        force=system.mesh_force,
        deviation=system.deviation(),
    )
    values = plain.pairs.compliance[0, 0]
    mean = 0.25 * (values[:, 2:] + 2.0 * values[:, 1:-1] + values[:, :-2])
    most = 0.25 * pair_table.SMOOTHED_SHARE * values.min(axis=1)
    off = np.abs(table.pairs.compliance[0, 0, :, 1:-1] - mean).max(axis=1)

    assert (off < (1.0 + 1e-6) * most).all()
    assert (np.abs(np.diff(values, axis=1)).max(axis=1) > 10.0 * most).all()


# the spur table's contact is a secant at the load of sound pairs
@pytest.mark.parametrize(("contact", "rtol"), [("linear", 3e-4), ("weber", 2e-3)])
def test_zero_helix_is_the_spur_pair_s_table(contact, rtol):
    system, table, _ = table_of(
        "gear=xiamen_23_84",
        f"mesh.contact={contact}",
        "mesh.n_slices=5",
    )
    force = system.mesh_force
    spur = loaded_pair_table(system.pair, system.material, system.mesh, force=force)
    roll = system.phases(128)
    exact = static_mesh(spur, pair_states(spur, roll), force)
    approach, _ = at_rest(table, roll, force)

    assert_close(approach, exact.approach, rtol)


def test_the_papers_law_has_one_chord():
    system, table, mesh = table_of(
        "mesh.law=paper",
        "mesh.allow_extrapolation=true",
        "mesh.contact=linear",
    )
    assert table.pairs.compliance.shape[2] == 1

    inside = np.linspace(0.1, 0.9, 17) * (system.pair.path_of_contact + mesh.lag[-1])
    exact = single_pair_stiffness(mesh, inside, system.mesh_force)
    result = 1.0 / np.interp(inside, table.position, table.pairs.compliance[0, 0, 0])

    # slices that bend each other are stiffer where only a part of the face is loaded
    assert (result > 0.999 * exact).all()
    assert_close(result, exact, 0.15)
    np.testing.assert_array_equal(table.pairs.gap[0, 0, 0], 0.0)
