"""What a helical machine is made of, which channels it has, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from chord_tables import Slices, as_chords, with_table
from numpy.testing import assert_allclose

from gensig.dynamics._layout import MOST_PAIRS, HelicalGroup
from gensig.dynamics.helical import AXIAL_DOFS, half_lag, pitches
from gensig.dynamics.integrator import check_channels
from gensig.dynamics.lanes import pack
from gensig.dynamics.mesh_statics import loss_arm
from gensig.dynamics.pair import PAIR_DOFS, Body, Support
from gensig.errors import ConfigError
from gensig.mesh.sliced.sliced_statics import left_out_energy
from gensig.sensing.manufacturing import nominal_gearbox
from gensig.systems.supports import in_gearbox
from gensig.units import is_turning, read

SUPPORT = {
    "stiffness_x_n_per_m": 1e8,
    "stiffness_y_n_per_m": 1e8,
    "damping_x_ns_per_m": 1.0,
    "damping_y_ns_per_m": 1.0,
}
AXIAL = {"stiffness_z_n_per_m": 2e7, "stiffness_tilt_nm_per_rad": 3e4, "damping_z_ns_per_m": 5.0,
         "damping_tilt_nms_per_rad": 0.1}  # fmt: skip


@pytest.fixture(scope="module")
def spur(xiamen, dynamics_of):
    return dynamics_of(xiamen)


@pytest.fixture(scope="module")
def helical(xiamen, spur):
    return with_table(
        spur, Slices(xiamen, 0.35, n_slices=8).table(np.array([0.0, 3e-6, 8e-6]))
    )


def test_a_support_takes_axial_keys_or_none(xiamen):
    assert_allclose(read(Support, SUPPORT, "support").stiffness_z, 0.0, rtol=0, atol=0)
    found = read(Support, {**SUPPORT, **AXIAL}, "support")
    assert_allclose(
        [found.stiffness_z, found.stiffness_tilt, found.damping_z, found.damping_tilt],
        [2e7, 3e4, 5.0, 0.1],
        rtol=1e-12,
    )


@pytest.mark.parametrize("key", AXIAL)
def test_negative_axial_keys_are_named(key):
    with pytest.raises(ConfigError, match=f"support.{key} = -1 must not be negative"):
        read(Support, {**SUPPORT, key: -1.0}, "support")


def test_a_stiffness_with_the_unit_of_another_is_refused():
    with pytest.raises(ConfigError, match="stiffness_tilt"):
        read(Support, {**SUPPORT, "stiffness_tilt_n_per_m": 1.0}, "support")


def test_masses_and_supports_stand_where_the_names_say(helical):
    system, mass = helical.system(), {}
    for name, gear in (("pinion", helical.pinion), ("wheel", helical.wheel)):
        held = gear.support
        mass.update({f"{name}_z": (gear.mass, held.stiffness_z, held.damping_z)})
        mass.update({f"{name}_tilt_{axis}": (gear.tilt_inertia, held.stiffness_tilt, held.damping_tilt)
                     for axis in "xy"})  # fmt: skip
    for name, expected in mass.items():
        place = helical.dofs.index(name)
        found = (
            system.mass[place],
            system.stiffness[place, place],
            system.damping[place, place],
        )
        assert_allclose(found, expected, rtol=1e-12)
        assert np.count_nonzero(system.stiffness[place]) == 1
        assert abs(system.rotation[place]) == 0.0


def test_motor_and_load_follow_the_gears(helical, machine):
    driven = machine(
        {"system.motor.inertia_kg_m2": 2e-3, "system.load.inertia_kg_m2": 0.05}
    )
    whole = replace(helical, motor=driven.motor, load=driven.load)
    assert whole.dofs == (*PAIR_DOFS, *AXIAL_DOFS, "motor_rotation", "load_rotation")
    assert_allclose(
        whole.approach_direction() @ whole.system().rotation, 0.0, rtol=0, atol=1e-15
    )
    assert isinstance(pack([whole], 1e-6), HelicalGroup)


def test_rest_is_where_nothing_is_pushed(helical):
    """Supports hold the mean mesh force; the pinion has not turned."""
    system, force, rest = helical.system(), helical.mesh_force, helical.rest()
    held = system.stiffness @ rest + force * helical.approach_direction()
    places = [
        place
        for place, name in enumerate(helical.dofs)
        if not name.endswith("rotation")
    ]
    assert_allclose(held[places], 0.0, rtol=0, atol=1e-9 * force)
    assert abs(rest[2]) == 0.0


@pytest.mark.parametrize("left_out", ["stiffness_z", "stiffness_tilt", "tilt_inertia"])
def test_a_gear_that_nothing_holds_is_refused(helical, left_out):
    body = helical.wheel
    if left_out == "tilt_inertia":
        loose = replace(body, tilt_inertia=0.0)
    else:
        loose = replace(body, support=replace(body.support, **{left_out: 0.0}))
    with pytest.raises(ConfigError, match=r"gear\.wheel: a helical pair needs"):
        replace(helical, wheel=loose)


def test_more_pairs_than_are_followed_are_refused(helical):
    last = helical.table.first_pitch + MOST_PAIRS + 1
    with pytest.raises(ConfigError, match=f"{MOST_PAIRS + 1} pairs of teeth"):
        replace(helical, table=replace(helical.table, last_pitch=last))


def test_channels_along_the_axis_are_those_of_helical_gears(helical, spur):
    check_channels(("pinion_z", "wheel_z"), helical.dofs)
    with pytest.raises(
        ConfigError, match=r"sensing\.channels: no channel pinion_z; allowed: pinion_x"
    ):
        check_channels(("pinion_z",), spur.dofs)
    assert [name for name in helical.dofs if is_turning(name)] == [
        "pinion_rotation", "wheel_rotation", "pinion_tilt_x", "pinion_tilt_y", "wheel_tilt_x", "wheel_tilt_y"
    ]  # fmt: skip


def test_a_gearbox_keeps_what_holds_the_axis(xiamen):
    held = read(Support, {**SUPPORT, **AXIAL}, "support")
    body = Body(mass=2.0, inertia=1e-3, support=held, tilt_inertia=6e-4)
    gearbox = nominal_gearbox(4)
    given = replace(
        xiamen.quality, support_damping_ratio_low=None, support_damping_ratio_high=None
    )
    assert in_gearbox(body, gearbox, slice(0, 2), given).support == held
    drawn = replace(
        xiamen.quality, support_damping_ratio_low=0.02, support_damping_ratio_high=0.04
    )
    found = in_gearbox(body, gearbox, slice(0, 2), drawn).support
    ratio = found.damping_x / (2.0 * np.sqrt(1e8 * 2.0))
    assert_allclose(found.damping_z, 2.0 * ratio * np.sqrt(2e7 * 2.0), rtol=1e-12)
    assert_allclose(found.damping_tilt, 2.0 * ratio * np.sqrt(3e4 * 6e-4), rtol=1e-12)


def test_pairs_and_lag_follow_the_table(helical, spur):
    assert pitches(spur.table) == (-1, 3)
    assert half_lag(spur.table) == 0.0
    first, last = pitches(helical.table)
    assert pack([helical], 1e-6).n_pairs == last - first > 4
    pair = helical.table.pair
    assert_allclose(
        2.0 * half_lag(helical.table), pair.overlap_ratio * pair.base_pitch, rtol=1e-12
    )


def test_sliding_turns_where_the_middle_of_the_face_passes_the_pitch_point(helical):
    table = helical.table
    turn, lag = table.pair.pitch_point + half_lag(table), half_lag(table)
    place = turn + np.linspace(-0.3, 0.3, 7) * lag
    arms = loss_arm(table, place)
    assert_allclose(
        arms, arms[::-1], rtol=1e-9, atol=0
    )  # against sliding on both sides
    assert (arms[[0, 1, 2]] > 0).all()
    assert abs(arms[3]) < 1e-12


def test_teeth_that_nobody_has_take_no_room(helical, spur):
    """Rows are the kinds of teeth that meet; sound ones stand first for the back flanks."""
    table = as_chords(spur.table, 2)
    three = {
        name: np.concatenate([getattr(table, name)] * 3)
        for name in ("compliance", "compliance_slope", "gap", "gap_slope")
    }
    kind = np.full_like(table.pinion_kind, 2)
    odd = replace(
        table, **three, pinion_kind=kind, pinion_present=np.array([True, True, False])
    )
    group, one = (
        pack([with_table(spur, odd)], 1e-6),
        pack([with_table(spur, table)], 1e-6),
    )
    assert group.table.size == 2 * one.table.size
    assert (group.tooth_row[: len(kind)] == -1).all()


def test_equal_chords_leave_nothing_out(spur, helical):
    for values in left_out_energy(as_chords(spur.table, 3)):
        assert np.abs(values).max() == 0.0
    energy, _ = left_out_energy(helical.table)
    assert energy.max() > 0.0
