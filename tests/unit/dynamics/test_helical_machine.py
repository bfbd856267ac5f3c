"""Equations, channels and refusals of a helical machine."""

from dataclasses import replace

import numpy as np
import pytest
from chord_tables import Slices, as_chords, repeated, with_table
from closeness import assert_close
from lane_tools import with_teeth
from refusals import refused

from gensig.dynamics._layout import MOST_PAIRS
from gensig.dynamics.backends.nystroem._group import ChordGroup, HelicalPairGroup
from gensig.dynamics.backends.nystroem.machine_lanes import (
    group_kind,
    missing_cells,
    pack,
)
from gensig.dynamics.equations import N_IN_PLANE
from gensig.dynamics.helical import AXIAL_DOFS, pitches
from gensig.dynamics.integrator import check_channels
from gensig.dynamics.mesh_teeth import loss_arm
from gensig.dynamics.pair import PAIR_DOFS, Body, Support
from gensig.errors import ConfigError
from gensig.mesh.tooth_table import GearTeeth, left_out_energy
from gensig.sensing.manufacturing import nominal_gearbox
from gensig.systems.supports import in_gearbox
from gensig.units import is_turning, read

SUPPORT = {
    "stiffness_x_n_per_m": 1e8,
    "stiffness_y_n_per_m": 1e8,
    "damping_x_ns_per_m": 1.0,
    "damping_y_ns_per_m": 1.0,
}
AXIAL = {
    "stiffness_z_n_per_m": 2e7,
    "stiffness_tilt_nm_per_rad": 3e4,
    "damping_z_ns_per_m": 5.0,
    "damping_tilt_nms_per_rad": 0.1,
}
ROTORS = {
    "system.motor.inertia_kg_m2": 2e-3,
    "system.load.inertia_kg_m2": 0.05,
}


@pytest.fixture(scope="module")
def spur(xiamen, running_of):
    return running_of(xiamen)


@pytest.fixture(scope="module")
def helical(xiamen, spur):
    table = Slices(xiamen, 0.35, n_slices=8).table(np.array([0.0, 3e-6, 8e-6]))
    return with_table(spur, table)


def test_a_support_takes_axial_keys_or_none():
    assert read(Support, SUPPORT, "support").stiffness_z == 0.0

    held = read(Support, {**SUPPORT, **AXIAL}, "support")
    axial = (
        held.stiffness_z,
        held.stiffness_tilt,
        held.damping_z,
        held.damping_tilt,
    )
    assert_close(axial, [2e7, 3e4, 5.0, 0.1], 1e-12)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        *[
            (
                {key: -1.0},
                f"support.{key} = -1 must not be negative",
            )
            for key in AXIAL
        ],
        ({"stiffness_tilt_n_per_m": 1.0}, "has the wrong unit"),
    ],
)
def test_impossible_axial_keys_are_refused(keys, text):
    with pytest.raises(ConfigError, match=text):
        read(Support, {**SUPPORT, **keys}, "support")


def test_masses_and_supports_of_the_axial_motions(helical):
    system = helical.equations
    for name in AXIAL_DOFS:
        dof = helical.dofs.index(name)
        gear = getattr(helical, name.partition("_")[0])
        held = gear.support
        expected = gear.mass, held.stiffness_z, held.damping_z
        if "tilt" in name:
            expected = (
                gear.tilt_inertia,
                held.stiffness_tilt,
                held.damping_tilt,
            )
        diagonals = (
            system.mass,
            np.diag(system.governed_stiffness),
            np.diag(system.governed_damping),
        )
        assert_close(
            [values[dof] for values in diagonals],
            expected,
            1e-12,
        )
        assert np.count_nonzero(system.governed_stiffness[dof]) == 1
        assert system.rotation[dof] == 0.0


def test_motor_and_load_follow_the_gears(helical, machine):
    driven = machine(ROTORS)
    whole = replace(helical, motor=driven.motor, load=driven.load)
    assert whole.dofs == (
        *PAIR_DOFS,
        *AXIAL_DOFS,
        "motor_rotation",
        "load_rotation",
    )

    approach = whole.approach_direction() @ whole.equations.rotation
    assert_close(approach, 0.0, atol=1e-15)
    assert isinstance(pack([whole.dynamics], 1e-6), HelicalPairGroup)


def test_gears_that_do_not_move_along_their_axes_are_another_group(helical):
    """As in a drive line of one helical mesh, whose other bodies stand as those of a pair."""
    equations = helical.equations
    (mesh,) = equations.meshes
    in_plane = {
        name: getattr(mesh, name)[:N_IN_PLANE] for name in ("touched", "reach", "slide")
    }
    flat = replace(equations, meshes=(replace(mesh, **in_plane),))
    assert flat.is_gear_pair
    assert group_kind(equations) is HelicalPairGroup
    assert group_kind(flat) is ChordGroup


def test_supports_hold_the_mesh_force_at_rest(helical):
    force = helical.mesh_force
    rest = helical.dynamics.rest
    held = (
        helical.equations.governed_stiffness @ rest
        + force * helical.approach_direction()
    )
    moving = [not name.endswith("rotation") for name in helical.dofs]

    assert_close(held[moving], 0.0, atol=1e-9 * force)
    assert rest[2] == 0.0


@pytest.mark.parametrize("key", ["stiffness_z", "stiffness_tilt", "tilt_inertia"])
def test_a_gear_without_axial_support_is_refused(helical, key):
    body = helical.wheel
    support = helical.wheel.support
    if key == "tilt_inertia":
        loose = replace(body, tilt_inertia=0.0)
    else:
        loose = replace(body, support=replace(support, **{key: 0.0}))

    with refused("gear.wheel: a helical pair needs"):
        replace(helical, wheel=loose)


def test_too_many_pairs_are_refused(helical):
    last = helical.table.first_pitch + MOST_PAIRS + 1
    with refused(f"{MOST_PAIRS + 1} pairs of teeth"):
        with_teeth(helical, table=replace(helical.table, last_pitch=last))


def test_axial_channels_are_those_of_helical_gears(helical, spur):
    check_channels(("pinion_z", "wheel_z"), helical.dofs)
    text = "sensing.channels: no channel pinion_z; allowed: pinion_x"
    with refused(text):
        check_channels(("pinion_z",), spur.dofs)

    turning = [name for name in helical.dofs if is_turning(name)]
    tilts = [name for name in AXIAL_DOFS if "tilt" in name]
    assert turning == [
        "pinion_rotation",
        "wheel_rotation",
        *tilts,
    ]


def test_a_gearbox_keeps_the_axial_support(xiamen):
    held = read(Support, {**SUPPORT, **AXIAL}, "support")
    body = Body(mass=2.0, inertia=1e-3, support=held, tilt_inertia=6e-4)

    def mounted(low, high):
        limits = {
            "support_damping_ratio_low": low,
            "support_damping_ratio_high": high,
        }
        quality = replace(xiamen.quality, **limits)
        return in_gearbox(body, nominal_gearbox(4), slice(0, 2), quality).support

    assert mounted(None, None) == held

    drawn = mounted(0.02, 0.04)
    twice_ratio = drawn.damping_x / np.sqrt(1e8 * 2.0)
    assert_close(drawn.damping_z, twice_ratio * np.sqrt(2e7 * 2.0), 1e-12)
    assert_close(
        drawn.damping_tilt,
        twice_ratio * np.sqrt(3e4 * 6e-4),
        1e-12,
    )


def test_pairs_and_lag_follow_the_table(helical, spur):
    assert pitches(spur.table) == (-1, 3)
    assert spur.table.half_lag == 0.0

    first, last = pitches(helical.table)
    assert pack([helical.dynamics], 1e-6).n_pairs == last - first > 4

    pair = helical.table.pair
    assert_close(
        2.0 * helical.table.half_lag,
        pair.overlap_ratio * pair.base_pitch,
        1e-12,
    )


def test_sliding_turns_with_the_middle_of_the_face_at_the_pitch_point(helical):
    table = helical.table
    lag = helical.table.half_lag
    position = table.pair.pitch_point + lag + np.linspace(-0.3, 0.3, 7) * lag
    arms = loss_arm(table, position)

    assert_close(arms, arms[::-1], 1e-9)
    assert (arms[:3] > 0).all()
    assert abs(arms[3]) < 1e-12


def test_unused_kinds_of_teeth_are_not_stored(spur):
    """Rows are the kinds of teeth that meet; sound ones come first for the back flanks."""
    table = as_chords(spur.table, 2)
    kind = np.ones_like(table.pinion.kind)
    kind[::3] = 2
    present = np.array([True, True, False, True])
    odd = replace(
        table,
        pinion=GearTeeth(kind=kind, present=present),
        parts=(repeated(table.pairs, 4),),
    )
    missing, sound = (
        pack([with_table(spur, each).dynamics], 1e-6) for each in (odd, table)
    )

    end = missing_cells().size
    assert missing.table.size - end == 3 * (sound.table.size - end)
    assert ((missing.tooth_row[: len(kind)] == -1) == (kind == 2)).all()


def test_equal_chords_leave_no_energy_out(spur, helical):
    assert np.all(np.array(left_out_energy(as_chords(spur.table, 3))) == 0.0)
    assert left_out_energy(helical.table)[0].max() > 0.0
