"""Faulty teeth in slices: the spur pair as the special case, part of the width, more fault never
stiffens.
"""

import functools

import numpy as np
import pytest

from gensig.errors import ConfigError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import read_faults
from gensig.mesh.load_distribution import loaded_pair_table, pair_states, static_mesh
from gensig.mesh.sliced.slice_teeth import merged_edges
from gensig.mesh.sliced.slices import Meeting, loaded_contact, sliced_mesh
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair

SPUR = ("gear=xiamen_23_84", "mesh.contact=linear")
CRACK = ("fault=crack", "fault.crack_depth_mm=2")


def case(*words):
    """A sliced pair, and its faults."""
    config = read_request(["system=helical_pair", *words]).config
    return read_sliced_pair(config), read_faults(config["fault"])


@functools.cache
def approach_of(*words, n_periods=9, meeting=None):
    """Pair, its faulty teeth, rolls, and approach in slices over mesh periods from the third before
    the fault on.
    """
    system, faults = case(*words)
    teeth = faulty_teeth(system.pair, faults)
    mesh = sliced_mesh(
        system.pair, system.material, system.mesh, system.slices, teeth=teeth
    )
    roll = system.phases(32, first_period=-3, n_periods=n_periods)
    return (
        system,
        teeth,
        roll,
        loaded_contact(mesh, roll, system.mesh_force, meeting).approach,
    )


@pytest.mark.parametrize(
    ("fault", "share"),
    [
        (("fault=crack", "fault.crack_depth_mm=2"), 3e-4),
        (("fault=pitting", "fault.pit_width_mm=20"), 5e-4),
        (("fault=broken",), 5e-4),
        (("fault=missing_tooth",), 5e-4),
        (("fault=wear",), 5e-4),
        (("fault=tip_relief",), 5e-4),
        (("fault=profile_error",), 5e-4),
        (("fault=pitch_error",), 5e-4),
        (("fault=runout",), 5e-4),
        # over part of the width the bodies give way slice by slice here, and as a whole there
        (("fault=crack", "fault.crack_depth_mm=2", "fault.crack_width_mm=10"), 3e-3),
        (("fault=crack", "fault.crack_depth_mm=2", "fault.crack_width_mm=5"), 3e-3),
        (
            (
                "fault=crack",
                "fault.crack_depth_mm=2",
                "fault.crack_width_mm=15",
                "fault.crack_front=parabolic",
            ),
            3e-3,
        ),
        (("fault=chipped",), 0.015),
        (("fault=pitting",), 0.05),
    ],
)
def test_spur_pair_s_own_table_with_zero_helix(fault, share):
    system, teeth, roll, approach = approach_of(*SPUR, *fault)
    table = loaded_pair_table(
        system.pair, system.material, system.mesh, teeth, force=system.mesh_force
    )
    exact = static_mesh(table, pair_states(table, roll), system.mesh_force).approach
    np.testing.assert_allclose(approach, exact, rtol=share)
    sound = approach_of(*SPUR)[3]
    assert np.abs(exact - sound).max() > 2.0 * share * exact.max() or fault[0] in (
        "fault=chipped",
        "fault=pitting",
    )


def test_errors_of_single_teeth_are_those_of_the_spur_pair():
    """Pitch errors and tilts of every tooth, and which teeth start."""
    system, _ = case(*SPUR)
    rng = np.random.default_rng(1)
    meeting = {
        "start_tooth_pinion": 5,
        "start_tooth_wheel": 11,
        "pinion_error": rng.uniform(-5e-6, 5e-6, 23),
        "wheel_error": rng.uniform(-5e-6, 5e-6, 84),
        "pinion_tilt": rng.uniform(-3e-4, 3e-4, 23),
        "wheel_tilt": rng.uniform(-3e-4, 3e-4, 84),
    }
    _, _, roll, approach = approach_of(*SPUR, n_periods=30, meeting=Meeting(**meeting))
    table = loaded_pair_table(
        system.pair, system.material, system.mesh, force=system.mesh_force
    )
    exact = static_mesh(
        table, pair_states(table, roll, **meeting), system.mesh_force
    ).approach
    np.testing.assert_allclose(approach, exact, rtol=1e-3)
    assert np.ptp(exact) > 5e-6


@pytest.mark.parametrize("misalignment", [2, 5, 10])
def test_misalignment_is_the_spur_pair_s_while_the_whole_face_bears(misalignment):
    words = (
        "gear=xiamen_23_84",
        "operating.torque_nm=100",
        "fault=misalignment",
        f"fault.misalignment_um={misalignment}",
    )
    system, teeth, roll, approach = approach_of(*words, n_periods=1)
    table = loaded_pair_table(
        system.pair, system.material, system.mesh, teeth, force=system.mesh_force
    )
    exact = static_mesh(table, pair_states(table, roll), system.mesh_force).approach
    np.testing.assert_allclose(approach, exact, rtol=0.01)
    assert (
        approach.mean()
        > approach_of(*words[:2], n_periods=1)[3].mean() + 0.4e-6 * misalignment
    )


def test_misalignment_of_teeth_is_that_of_the_shafts():
    """As a fault of the pinion's teeth, tilted about the end that bears, and as a modification of
    the pair.
    """
    tilted = approach_of(
        "fault=misalignment", "fault.misalignment_um=14", "gear.pinion.face_width_mm=14"
    )[3]
    system, _ = case("modification.misalignment_um=14", "gear.pinion.face_width_mm=14")
    roll = system.phases(32, first_period=-3, n_periods=9)
    shafts = loaded_contact(system.sliced_mesh(), roll, system.mesh_force).approach
    np.testing.assert_allclose(tilted, shafts, rtol=1e-6)


def added(*words):
    """What a fault adds to the approach, over its own slices with nothing lost."""
    return approach_of(*words)[3] - approach_of()[3]


@pytest.mark.parametrize(
    "steps",
    [
        [
            (*CRACK[:1], f"fault.crack_depth_mm={depth}")
            for depth in (0.1, 0.5, 1.0, 1.6)
        ],
        [
            (*CRACK[:1], "fault.crack_depth_mm=1", f"fault.crack_width_mm={width}")
            for width in (1.0, 4.0, 9.0, 15.0)
        ],
        [
            (
                "fault=pitting",
                "fault.pit_length_mm=0.6",
                "fault.pit_width_mm=5",
                f"fault.pit_depth_mm={depth}",
            )
            for depth in (1e-3, 3e-3, 1e-2, 0.1)
        ],
        [
            ("fault=pitting", "fault.pit_length_mm=0.6", f"fault.pit_width_mm={width}")
            for width in (1, 4, 8, 14)
        ],
        [
            ("fault=chipped", f"fault.chip_height_mm={height}")
            for height in (0.2, 0.6, 1.2, 2.0)
        ],
        [
            ("fault=broken", f"fault.broken_height_mm={height}")
            for height in (0.2, 0.8, 1.5, 2.5)
        ],
        [("fault=wear", f"fault.wear_depth_um={depth}") for depth in (1, 5, 15)],
        [
            ("fault=misalignment", f"fault.misalignment_um={size}")
            for size in (2, 8, 30)
        ],
    ],
    ids=lambda steps: steps[0][0] + " " + steps[0][-1],
)
def test_more_fault_never_stiffens(steps):
    less = np.zeros(32 * 9)
    for words in steps:
        more = added(*words)
        # other slices settle elsewhere, by 3 nm at most
        assert (more - less).min() > -3e-9
        assert more.max() > less.max()
        less = more


@pytest.mark.parametrize(
    ("whole", "part"),
    [
        (
            ("fault=crack", "fault.crack_depth_mm=1"),
            ("fault=crack", "fault.crack_depth_mm=1", "fault.crack_width_mm=14.999"),
        ),
        (
            ("fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=15"),
            ("fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=13.999"),
        ),
        (
            ("fault=broken", "fault.broken_height_mm=1"),
            (
                "fault=chipped",
                "fault.chip_shape=rectangular",
                "fault.chip_height_mm=1",
                "fault.chip_width_mm=14.999",
            ),
        ),
    ],
)
def test_a_fault_over_nearly_the_whole_face_is_one_over_all_of_it(whole, part):
    np.testing.assert_allclose(approach_of(*part)[3], approach_of(*whole)[3], rtol=2e-3)


def test_a_small_fault_is_nearly_none():
    for words in (
        ("fault=crack", "fault.crack_depth_mm=1e-4"),
        ("fault=crack", "fault.crack_depth_mm=1", "fault.crack_width_mm=0.01"),
        ("fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=0.01"),
        ("fault=chipped", "fault.chip_height_mm=0.5", "fault.chip_width_mm=0.01"),
    ):
        assert np.abs(added(*words)).max() < 5e-9


def test_a_crack_is_felt_where_it_is():
    """The cracked half of the face takes less of its pair's load than the same half of a sound
    pair.
    """
    system, faults = case(
        "fault=crack", "fault.crack_depth_mm=1.5", "fault.crack_width_mm=7.5"
    )
    cracked, sound = system.transmission_error(faults), system.transmission_error()
    first_half = sound.slice_place < 6.5e-3
    tile = np.tile(sound.contact.line_load, (cracked.n_periods, 1, 1))
    of_fault = cracked.contact.pair_index == 0
    before, after = tile[of_fault], cracked.contact.line_load[of_fault]
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
    contact, place = result.contact, result.slice_place
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
    np.testing.assert_allclose(load.sum(axis=1), system.mesh_force, rtol=1e-9)


def test_as_many_periods_as_see_the_fault():
    system, faults = case("fault=crack", "fault.crack_depth_mm=1", "fault.tooth=7")
    result, sound = system.transmission_error(faults), system.transmission_error()
    more = (result.error - np.tile(sound.error, result.n_periods)).reshape(-1, 64)
    assert more.max() > 0.5e-6
    # two sound periods before, save corner contact, and what is left of the second after
    assert np.abs(more[0]).max() < 1e-12
    assert np.abs(more[-1]).max() < 1e-12
    assert sound.n_periods == 1
    assert system.transmission_error(case("fault=wear")[1]).n_periods == 1
    assert system.transmission_error(case("fault=runout")[1]).n_periods == 61


def test_slices_converge_with_a_fault():
    """In slices, and in points of the profile table."""

    def added_most(*words):
        more = added_with(
            "fault=crack", "fault.crack_depth_mm=1", "fault.crack_width_mm=5", *words
        )
        return more.max()

    def added_with(*words):
        number = [word for word in words if word.startswith("mesh.")]
        return approach_of(*words)[3] - approach_of(*number)[3]

    finest = added_most("mesh.n_slices=160")
    errors = [abs(added_most(f"mesh.n_slices={n}") - finest) for n in (5, 40)]
    assert errors[1] < 0.5 * errors[0] + 1e-3 * finest
    assert errors[1] < 0.02 * finest
    pit = ("fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=5")
    points = [
        added_with(*pit, f"mesh.points_per_pitch={n}").max() for n in (128, 512, 2048)
    ]
    assert abs(points[1] - points[2]) < 0.01 * points[2]


def test_slices_end_where_a_fault_does():
    system, faults = case(
        "fault=pitting", "fault.pit_length_mm=0.6", "fault.pit_width_mm=5"
    )
    edges = merged_edges(system.pair, 40, faulty_teeth(system.pair, faults).values())
    assert len(edges) == 43
    # the pinion is 15 mm wide, the wheel 14: the pit lies in the middle of both
    assert np.isin([4.5e-3, 9.5e-3], np.round(edges, 9)).all()
    np.testing.assert_allclose(edges[[0, -1]], [0.0, 14e-3])
    assert np.diff(edges).min() > 0.0


def test_independent_slices_refuse_a_fault_over_part_of_the_face():
    words = (
        "mesh.slice_coupling=independent",
        "fault=crack",
        "fault.crack_depth_mm=1",
        "fault.crack_width_mm=5",
    )
    with pytest.raises(ConfigError, match=r"mesh\.independent_faulty_slices=true"):
        approach_of(*words)
    approach_of(*words, "mesh.independent_faulty_slices=true")
    approach_of(
        "mesh.slice_coupling=independent", "fault=crack", "fault.crack_depth_mm=1"
    )
    with pytest.raises(ConfigError, match="over part of the face"):
        approach_of("mesh.slice_coupling=independent", "fault=chipped")
