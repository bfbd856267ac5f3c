"""Faulty teeth in slices: the spur pair as the special case, part of the width, more fault never
stiffens.
"""

import functools

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.faults.base import faulty_teeth
from gensig.faults.registry import read_faults
from gensig.mesh.load_distribution import (
    PERFECT,
    Meeting,
    loaded_pair_table,
    pair_states,
    static_mesh,
)
from gensig.mesh.sliced.slice_teeth import merged_edges
from gensig.mesh.sliced.slices import loaded_contact
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair

SPUR = ("gear=xiamen_23_84", "mesh.contact=linear")


@functools.cache
def case(*typed):
    """A sliced pair, and its faults; ``typed`` are words, or several in one with spaces."""
    words = " ".join(typed).split()
    config = read_request(["system=helical_pair", *words]).config
    return read_sliced_pair(config), read_faults(config["fault"])


@functools.cache
def approach_of(*words, n_periods=9, meeting=PERFECT):
    """Pair, its faulty teeth, rolls from the third period before the fault on, and approach."""
    system, faults = case(*words)
    teeth = faulty_teeth(system.pair, faults)
    roll = system.phases(16, first_period=-3, n_periods=n_periods)
    mesh = system.sliced_mesh(faults)
    contact = loaded_contact(mesh, roll, system.mesh_force, meeting)
    return system, teeth, roll, contact.approach


def spur_approach(system, teeth, roll, meeting=PERFECT):
    """Approach of the spur pair's table."""
    force = system.mesh_force
    table = loaded_pair_table(
        system.pair,
        system.material,
        system.mesh,
        teeth,
        force=force,
    )
    return static_mesh(table, pair_states(table, roll, meeting), force).approach


@pytest.mark.parametrize(
    ("fault", "share", "least"),
    [
        ("crack fault.crack_depth_mm=2", 3e-4, 2.0),
        ("pitting fault.pit_width_mm=20", 5e-4, 2.0),
        ("broken", 5e-4, 2.0),
        ("missing_tooth", 5e-4, 2.0),
        ("wear", 5e-4, 2.0),
        ("tip_relief", 5e-4, 2.0),
        ("profile_error", 5e-4, 2.0),
        ("pitch_error", 5e-4, 2.0),
        ("runout", 5e-4, 2.0),
        # over part of the width bodies deflect by slices here, as a whole in the spur table
        (
            "crack fault.crack_depth_mm=2 fault.crack_width_mm=10",
            3e-3,
            2.0,
        ),
        (
            "crack fault.crack_depth_mm=2 fault.crack_width_mm=5",
            3e-3,
            2.0,
        ),
        (
            "crack fault.crack_depth_mm=2 fault.crack_width_mm=15 fault.crack_front=parabolic",
            3e-3,
            2.0,
        ),
        ("chipped", 0.015, 0.0),
        ("pitting", 0.05, 0.0),
    ],
)
def test_zero_helix_is_the_spur_pair_s_table(fault, share, least):
    system, teeth, roll, approach = approach_of(*SPUR, f"fault={fault}")
    exact = spur_approach(system, teeth, roll)
    assert_close(approach, exact, share)
    sound = approach_of(*SPUR)[3]
    assert np.abs(exact - sound).max() > least * share * exact.max()


def test_errors_of_single_teeth_are_those_of_the_spur_pair():
    """Pitch errors and tilts of every tooth, and other start teeth."""
    system, _ = case(*SPUR)
    rng = np.random.default_rng(1)
    meeting = Meeting(
        start_teeth=(5, 11),
        errors=(rng.uniform(-5e-6, 5e-6, 23), rng.uniform(-5e-6, 5e-6, 84)),
        tilts=(rng.uniform(-3e-4, 3e-4, 23), rng.uniform(-3e-4, 3e-4, 84)),
    )
    _, teeth, roll, approach = approach_of(*SPUR, n_periods=30, meeting=meeting)
    exact = spur_approach(system, teeth, roll, meeting)

    assert_close(approach, exact, 1e-3)
    assert np.ptp(exact) > 5e-6


@pytest.mark.parametrize("misalignment", [2, 10])
def test_misalignment_is_the_spur_pair_s_while_the_whole_face_bears(misalignment):
    spur = ("gear=xiamen_23_84", "operating.torque_nm=100")
    fault = f"fault=misalignment fault.misalignment_um={misalignment}"
    *of_spur, approach = approach_of(*spur, fault, n_periods=1)

    assert_close(approach, spur_approach(*of_spur), 0.01)

    aligned = approach_of(*spur, n_periods=1)[3]
    assert approach.mean() > aligned.mean() + 0.4e-6 * misalignment


def test_misalignment_of_teeth_is_that_of_the_shafts():
    """A fault of the pinion's teeth, tilted about the end that bears, and a modification."""
    narrow = "gear.pinion.face_width_mm=14"
    tilted = approach_of("fault=misalignment fault.misalignment_um=14", narrow)[3]
    shafts = approach_of("modification.misalignment_um=14", narrow)[3]
    assert_close(tilted, shafts, 1e-6)


def added(*words):
    """Approach that a fault adds."""
    return approach_of(*words)[3] - approach_of()[3]


@pytest.mark.parametrize(
    ("fault", "key", "values"),
    [
        ("crack", "crack_depth_mm", (0.1, 0.5, 1.6)),
        (
            "crack fault.crack_depth_mm=1",
            "crack_width_mm",
            (1, 4, 15),
        ),
        (
            "pitting fault.pit_length_mm=0.6 fault.pit_width_mm=5",
            "pit_depth_mm",
            (1e-3, 1e-2, 0.1),
        ),
        (
            "pitting fault.pit_length_mm=0.6",
            "pit_width_mm",
            (1, 4, 14),
        ),
        ("chipped", "chip_height_mm", (0.2, 0.6, 2.0)),
        ("broken", "broken_height_mm", (0.2, 0.8, 2.5)),
        ("wear", "wear_depth_um", (1, 5, 15)),
        ("misalignment", "misalignment_um", (2, 8, 30)),
    ],
)
def test_more_fault_never_stiffens(fault, key, values):
    less = np.zeros(16 * 9)
    for value in values:
        more = added(f"fault={fault} fault.{key}={value}")
        # other slices settle elsewhere, by 4 nm at most
        assert (more - less).min() > -4e-9
        assert more.max() > less.max()
        less = more


@pytest.mark.parametrize(
    ("whole", "part"),
    [
        (
            "crack fault.crack_depth_mm=1",
            "crack fault.crack_depth_mm=1 fault.crack_width_mm=14.999",
        ),
        (
            "pitting fault.pit_length_mm=0.6 fault.pit_width_mm=15",
            "pitting fault.pit_length_mm=0.6 fault.pit_width_mm=13.999",
        ),
        (
            "broken fault.broken_height_mm=1",
            "chipped fault.chip_shape=rectangular fault.chip_height_mm=1 "
            "fault.chip_width_mm=14.999",
        ),
    ],
)
def test_a_fault_over_nearly_the_whole_face_is_one_over_all_of_it(whole, part):
    nearly, full = (approach_of(f"fault={fault}")[3] for fault in (part, whole))
    assert_close(nearly, full, 2e-3)


@pytest.mark.parametrize(
    "fault",
    [
        "crack fault.crack_depth_mm=1e-4",
        "crack fault.crack_depth_mm=1 fault.crack_width_mm=0.01",
        "pitting fault.pit_length_mm=0.6 fault.pit_width_mm=0.01",
        "chipped fault.chip_height_mm=0.5 fault.chip_width_mm=0.01",
    ],
)
def test_a_small_fault_is_nearly_none(fault):
    assert np.abs(added(f"fault={fault}")).max() < 5e-9


def test_a_crack_is_felt_where_it_is():
    """The cracked half of the face takes less load than the same half of a sound tooth pair."""
    system, faults = case(
        "fault=crack",
        "fault.crack_depth_mm=1.5",
        "fault.crack_width_mm=7.5",
    )
    cracked = system.transmission_error(faults)
    sound = system.transmission_error()
    first_half = sound.slice_middle < 6.5e-3
    tile = np.tile(sound.contact.line_load, (cracked.n_periods, 1, 1))
    of_fault = cracked.contact.pair_index == 0
    before = tile[of_fault]
    after = cracked.contact.line_load[of_fault]

    assert after[:, first_half].sum() < 0.95 * before[:, first_half].sum()
    assert after[:, ~first_half].sum() > 0.99 * before[:, ~first_half].sum()


def test_flank_that_is_gone_bears_nothing():
    system, faults = case(
        "fault=pitting",
        "fault.pit_length_mm=0.8",
        "fault.pit_width_mm=5",
        "fault.pit_depth_mm=0.3",
    )
    result = system.transmission_error(faults)
    contact = result.contact
    place = result.slice_middle
    inside = (contact.pair_index == 0)[..., None] & (np.abs(place - 7e-3) < 2.3e-3)
    pitch_point = np.abs(contact.position - system.pair.pitch_point) < 0.03e-3

    assert contact.line_load[inside & pitch_point].max() == 0.0

    beside = (contact.pair_index == 0)[..., None] & (np.abs(place - 2e-3) < 1e-3)
    assert contact.line_load[beside & pitch_point].min() > 0.0


def test_a_missing_tooth_carries_nothing_and_the_others_all():
    system, faults = case("fault=missing_tooth")
    result = system.transmission_error(faults)
    load = (result.contact.line_load * np.diff(result.slice_edges)).sum(axis=2)
    assert load[result.contact.pair_index == 0].max() == 0.0
    assert_close(load.sum(axis=1), system.mesh_force, 1e-9)


def test_as_many_periods_as_see_the_fault():
    system, faults = case("fault=crack", "fault.crack_depth_mm=1", "fault.tooth=7")
    result = system.transmission_error(faults)
    sound = system.transmission_error()
    more = (result.error - np.tile(sound.error, result.n_periods)).reshape(-1, 64)

    assert more.max() > 0.5e-6
    # two sound periods before, save corner contact, and what is left of the second after
    assert np.abs(more[0]).max() < 1e-12
    assert np.abs(more[-1]).max() < 1e-12
    assert sound.n_periods == 1
    assert system.transmission_error(case("fault=wear")[1]).n_periods == 1
    assert system.transmission_error(case("fault=runout")[1]).n_periods == 61


def test_slices_converge_with_a_fault():
    """In number of slices, and in points of the profile table."""

    def most_added(fault, number):
        return (approach_of(fault, number)[3] - approach_of(number)[3]).max()

    crack = "fault=crack fault.crack_depth_mm=1 fault.crack_width_mm=5"
    coarse, fine, finest = (
        most_added(crack, f"mesh.n_slices={n}") for n in (5, 40, 120)
    )

    assert abs(fine - finest) < 0.5 * abs(coarse - finest) + 1e-3 * finest
    assert abs(fine - finest) < 0.02 * finest

    pit = "fault=pitting fault.pit_length_mm=0.6 fault.pit_width_mm=5"
    fine, finest = (most_added(pit, f"mesh.points_per_pitch={n}") for n in (512, 1024))
    assert abs(fine - finest) < 0.01 * finest


def test_slices_end_where_a_fault_does():
    system, faults = case(
        "fault=pitting",
        "fault.pit_length_mm=0.6",
        "fault.pit_width_mm=5",
    )
    edges = merged_edges(
        system.pair,
        40,
        faulty_teeth(system.pair, faults).values(),
    )
    assert len(edges) == 43
    # the pinion is 15 mm wide, the wheel 14: the pit lies in the middle of both
    assert np.isin([4.5e-3, 9.5e-3], np.round(edges, 9)).all()
    assert_close(edges[[0, -1]], [0.0, 14e-3], 1e-7)
    assert np.diff(edges).min() > 0.0


def test_independent_slices_refuse_a_fault_over_part_of_the_face():
    words = (
        "mesh.slice_coupling=independent",
        "fault=crack",
        "fault.crack_depth_mm=1",
        "fault.crack_width_mm=5",
    )
    with refused("mesh.independent_faulty_slices=true"):
        approach_of(*words)

    approach_of(*words, "mesh.independent_faulty_slices=true")
    approach_of(
        "mesh.slice_coupling=independent",
        "fault=crack",
        "fault.crack_depth_mm=1",
    )
    with refused("over part of the face"):
        approach_of("mesh.slice_coupling=independent", "fault=chipped")
