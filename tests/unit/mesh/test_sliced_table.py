"""Chords of the force of sliced pairs: the same equilibrium as the slices, the spur table, convex
and within 1 %.
"""

from dataclasses import replace

import numpy as np
import pytest

from gensig.errors import FaultError
from gensig.faults.registry import read_faults
from gensig.mesh.load_distribution import loaded_pair_table, pair_states, static_mesh
from gensig.mesh.pair_table import node_positions
from gensig.mesh.sliced._slice_kernels import bite_forces
from gensig.mesh.sliced.sliced_table import DEEPEST, N_CHORDS, sliced_table
from gensig.mesh.sliced.slices import (
    Meeting,
    loaded_contact,
    single_pair_stiffness,
    slice_places,
)
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair


def table_of(*words, teeth=None):
    """A system, its table under its torque, and its sliced mesh."""
    system = read_sliced_pair(read_request(["system=helical_pair", *words]).config)
    deviation = None
    if system.modification.is_any:
        places = (
            node_positions(system.pair, system.mesh),
            slice_places(system.pair, system.slices),
        )
        deviation = system.modification.deviation(system.pair, *places)
    table = sliced_table(
        system.pair,
        system.material,
        system.mesh,
        system.slices,
        teeth,
        force=system.mesh_force,
        deviation=deviation,
    )
    return system, table, system.sliced_mesh()


def at_rest(table, roll, force, errors=None):
    """Approach, and load (phase, pair) of the chords under a total force, by bisection; ``errors``
    by tooth as in
    ``Meeting``, tilts taken at the middle of the face."""
    pitch = table.pair.base_pitch
    index = np.floor(roll / pitch).astype(int)[:, None] - table.first_pitch
    index = index - np.arange(table.last_pitch - table.first_pitch)
    position = roll[:, None] - index * pitch
    kinds = (
        table.pinion_kind[index % len(table.pinion_kind)],
        table.wheel_kind[index % len(table.wheel_kind)],
    )
    place = (position - table.position[0]) / (table.position[1] - table.position[0])
    cell = np.clip(place.astype(int), 0, len(table.position) - 2)
    part = (place - cell)[:, :, None]
    chords = np.arange(len(table.depth))

    def read(values):
        low, high = (
            values[
                kinds[0][..., None], kinds[1][..., None], chords, (cell + k)[..., None]
            ]
            for k in (0, 1)
        )
        return (1.0 - part) * low + part * high

    own, gap = read(table.compliance) - table.shared_compliance, read(table.gap)
    if errors is not None:
        middle = position - table.middle_lag - table.pair.pitch_point
        for error, tilt, n in (
            (errors.pinion_error, errors.pinion_tilt, len(table.pinion_kind)),
            (errors.wheel_error, errors.wheel_tilt, len(table.wheel_kind)),
        ):
            gap += (error[index % n] + tilt[index % n] * middle)[:, :, None]
    gap[~(table.pinion_present[kinds[0]] & table.wheel_present[kinds[1]])] = np.inf

    def load(within):
        return np.maximum(((within[:, None, None] - gap) / own).max(axis=2), 0.0)

    low = gap.min(axis=(1, 2))
    high = low + 1e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        enough = load(middle).sum(axis=1) > force
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return low + table.shared_compliance * force, load(low)


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
        ("modification=beihang_both", "modification.misalignment_um=15"),
        ("gear=xiamen_23_84",),
        ("mesh.n_slices=160",),
    ],
)
def test_equilibrium_is_that_of_the_slices(words):
    system, table, mesh = table_of(*words)
    roll = system.phases(64)
    for part in (0.5, 1.0, 2.5):
        exact = loaded_contact(mesh, roll, part * system.mesh_force)
        approach, load = at_rest(table, roll, part * system.mesh_force)
        np.testing.assert_allclose(approach, exact.approach, rtol=5e-3 / min(part, 1.0))
        ripple = np.ptp(exact.approach)
        assert (
            np.ptp(approach - exact.approach)
            < 0.1 * ripple + 2e-3 * exact.approach.mean()
        )
        own = (exact.line_load * mesh.slice_width).sum(axis=2)
        # newest first in both; the table follows fewer
        behind = load.shape[1] - own.shape[1]
        np.testing.assert_allclose(
            load[:, behind:] if behind > 0 else load,
            own[:, : load.shape[1]],
            atol=0.012 * part * system.mesh_force,
        )


@pytest.mark.parametrize(("n_slices", "share"), [(6, 0.5), (12, 0.2), (20, 0.1)])
def test_few_slices_that_enter_over_their_width_are_many(n_slices, share):
    """The ripple of the table is that of 320 slices, which that of as few slices whole is not."""
    system, table, _ = table_of(f"mesh.n_slices={n_slices}")
    roll, force = system.phases(64), system.mesh_force
    few, many = (
        loaded_contact(table_of(f"mesh.n_slices={count}")[2], roll, force).approach
        for count in (n_slices, 320)
    )
    found = at_rest(table, roll, force)[0]
    error, whole = (
        np.ptp(approach - approach.mean() - many + many.mean())
        for approach in (found, few)
    )
    assert error < share * np.ptp(many)
    assert error < 0.4 * whole


@pytest.mark.parametrize(
    "words", [(), ("gear=chongqing_40_162",), ("gear=xiamen_23_84",)]
)
def test_chords_err_by_less_than_a_hundredth_of_the_set_force(words):
    """One pair alone at 60 depths, to three times that of the set torque, and positions between the
    nodes.
    """
    system, table, mesh = table_of(*words)
    end = system.pair.path_of_contact + mesh.lag[-1]
    place = np.random.default_rng(0).uniform(-0.02, 1.02, 40) * end
    position = place[:, None] - mesh.lag
    structure = np.interp(position, mesh.position, mesh.structure)
    constant = np.interp(position, mesh.position, mesh.contact_constant)
    gap = np.array(
        [
            np.interp(at, mesh.position, row)
            for at, row in zip(position.T, mesh.gap, strict=True)
        ]
    ).T
    first, exact = np.empty(40), np.empty((40, 60))
    depth = table.depth[-1] * np.arange(1, 61) / 60
    bite_forces(
        structure,
        mesh.contact_factor,
        constant,
        mesh.log_weight,
        gap.copy(),
        np.tile(mesh.slice_width, (40, 1)),
        mesh.slice_width,
        mesh.coupling_length_squared,
        system.mesh_force / system.pair.face_width,
        depth,
        1.0,
        first,
        exact,
    )
    own, far = (
        np.array([np.interp(place, table.position, row) for row in values[0, 0]])
        for values in (table.compliance - table.shared_compliance, table.gap)
    )
    found = np.maximum(
        ((first[:, None, None] + depth[:, None] - far.T[:, None]) / own.T[:, None]).max(
            axis=2
        ),
        0.0,
    )
    assert exact.max() > system.mesh_force
    np.testing.assert_allclose(found, exact, atol=0.01 * system.mesh_force)


@pytest.mark.parametrize(
    ("fault", "share"),
    [
        (("fault=crack", "fault.crack_depth_mm=1", "fault.crack_width_mm=5"), 2e-3),
        (("fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=5"), 2e-3),
        (("fault=chipped",), 2e-3),
        (("fault=broken", "fault.broken_height_mm=1"), 3e-3),
        (("fault=missing_tooth",), 2e-3),
        (("fault=pitch_error",), 2e-3),
        (("fault=wear",), 5e-3),
        (("fault=misalignment",), 0.01),
    ],
)
def test_faulty_teeth_have_their_own_chords(fault, share):
    """Over the mesh periods that see tooth 0, which meets sound ones and is met by nobody else."""
    system, _, _ = table_of(*fault)
    faults = read_faults(read_request(["system=helical_pair", *fault]).config["fault"])
    table = system.mesh_table(faults)
    roll = system.phases(64, first_period=-2, n_periods=8)
    exact = loaded_contact(system.sliced_mesh(faults), roll, system.mesh_force)
    approach, _ = at_rest(table, roll, system.mesh_force)
    np.testing.assert_allclose(approach, exact.approach, rtol=share)
    assert len(table.pinion_present) == 2
    assert len(table.wheel_present) == 1
    sound = at_rest(system.mesh_table(), roll, system.mesh_force)[0]
    assert np.abs(exact.approach - sound).max() > 2.0 * share * sound.max()


def test_errors_of_single_teeth_open_all_chords():
    """Pitch errors and tilts of a good grade 5 gear; a tilt acts slice by slice, in the table at
    the middle.
    """
    system, table, mesh = table_of()
    rng = np.random.default_rng(2)
    errors = Meeting(
        pinion_error=rng.uniform(-2e-6, 2e-6, 61),
        wheel_error=rng.uniform(-2e-6, 2e-6, 132),
        pinion_tilt=rng.uniform(-1e-4, 1e-4, 61),
        wheel_tilt=rng.uniform(-1e-4, 1e-4, 132),
    )
    roll = system.phases(32, n_periods=20)
    exact = loaded_contact(mesh, roll, system.mesh_force, errors).approach
    found = at_rest(table, roll, system.mesh_force, errors)[0]
    np.testing.assert_allclose(found, exact, rtol=5e-3)
    assert np.ptp(exact) > 1e-6


def test_teeth_that_all_share_a_form_are_looked_at_once():
    """What nobody meets is not computed; sound ones stay kind 0 for the back flanks."""
    system, _, _ = table_of()
    read = read_request(["system=helical_pair", "fault=profile_error"]).config
    form = replace(read_faults(read["fault"])[0], tooth="all")
    crack = read_faults(
        read_request(
            [
                "system=helical_pair",
                "fault=crack",
                "fault.crack_depth_mm=1",
                "fault.tooth=3",
            ]
        ).config["fault"]
    )
    table = system.mesh_table((form, *crack))
    assert table.compliance.shape[:2] == (3, 1)
    assert table.pinion_kind[3] == 2
    assert np.bincount(table.pinion_kind).tolist() == [0, 60, 1]
    again = system.mesh_table((form,))
    np.testing.assert_array_equal(again.compliance[1, 0], table.compliance[1, 0])
    np.testing.assert_array_equal(again.depth, table.depth)
    assert system.mesh_table((form,)) is again


def test_too_many_different_teeth_are_refused():
    system, _, _ = table_of()
    runout = read_faults(
        read_request(["system=helical_pair", "fault=runout"]).config["fault"]
    )[0]
    with pytest.raises(
        FaultError,
        match="62 different teeth of the pinion and 133 of the wheel make 8246 pairs",
    ):
        system.mesh_table((runout, replace(runout, gear="wheel")))


def test_chords_are_convex_and_meet():
    system, table, _ = table_of()
    assert len(table.depth) == N_CHORDS
    assert table.depth[0] == 0.0
    own, gap = table.compliance[0, 0] - table.shared_compliance, table.gap[0, 0]
    near = gap[0] < 20e-6
    assert (np.diff(own[:, near], axis=0) < 1e-4 * own[1:, near]).all()
    force = [
        (gap[0] + table.depth[1:, None] - gap[k : k + N_CHORDS - 1])
        / own[k : k + N_CHORDS - 1]
        for k in (0, 1)
    ]
    np.testing.assert_allclose(
        force[0][:, near], force[1][:, near], atol=2e-3 * system.mesh_force
    )
    # deep enough for three times the load, and the set chord holds the mean load
    deepest = loaded_contact(
        system.sliced_mesh(), system.phases(64), system.mesh_force
    ).approach.max()
    assert table.depth[-1] < DEEPEST * (
        deepest - table.shared_compliance * system.mesh_force
    )
    assert 0 < table.set_chord < N_CHORDS


def test_ends_are_out_of_reach():
    for words in ((), ("gear=xiamen_23_84",), ("gear=chongqing_40_162",)):
        _, table, _ = table_of(*words)
        pitch = table.pair.base_pitch
        assert table.position[0] == pytest.approx(table.first_pitch * pitch)
        assert table.position[-1] == pytest.approx(table.last_pitch * pitch)
        assert table.gap[0, 0, 0, [0, -1]].min() > 90e-6
        assert np.isfinite(table.compliance).all()
        assert np.isfinite(table.gap).all()


def test_slopes_are_those_of_the_values():
    _, table, _ = table_of()
    distance = table.position[1] - table.position[0]
    for values, slopes in (
        (table.compliance, table.compliance_slope),
        (table.gap, table.gap_slope),
    ):
        step = 0.5 * distance * (slopes[..., 1:] + slopes[..., :-1])
        np.testing.assert_allclose(
            np.diff(values, axis=3), step, atol=1e-9 * np.abs(values).max()
        )


@pytest.mark.parametrize("contact", ["linear", "weber"])
def test_zero_helix_is_the_spur_pair_s_table(contact):
    system, table, _ = table_of(
        "gear=xiamen_23_84", f"mesh.contact={contact}", "mesh.n_slices=5"
    )
    force = system.mesh_force
    spur = loaded_pair_table(system.pair, system.material, system.mesh, force=force)
    roll = system.phases(128)
    exact = static_mesh(spur, pair_states(spur, roll), force)
    approach, _ = at_rest(table, roll, force)
    # the spur table's contact is a secant at the load of sound pairs
    np.testing.assert_allclose(
        approach, exact.approach, rtol=3e-4 if contact == "linear" else 2e-3
    )


def test_the_papers_law_has_one_chord():
    system, table, mesh = table_of(
        "mesh.law=paper", "mesh.allow_extrapolation=true", "mesh.contact=linear"
    )
    assert table.compliance.shape[2] == 1
    inside = np.linspace(0.1, 0.9, 17) * (system.pair.path_of_contact + mesh.lag[-1])
    exact = single_pair_stiffness(mesh, inside, system.mesh_force)
    found = 1.0 / np.interp(inside, table.position, table.compliance[0, 0, 0])
    # slices that bend each other are stiffer where only a part of the face is loaded
    assert (found > 0.999 * exact).all()
    np.testing.assert_allclose(found, exact, rtol=0.15)
    np.testing.assert_array_equal(table.gap[0, 0, 0], 0.0)
