"""Modified flanks of spur gears: on every tooth, before errors and faults, in tables, statics and
records.
"""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import one, side_of
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dynamics.lanes import tooth_rows
from gensig.errors import GeometryError
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.modification import PLAIN, FlankModification, PairModification
from gensig.systems.base import simulate_together
from gensig.systems.registry import read_system
from gensig.systems.run import Run

UM = 1e-6
MM = 1e-3
SIDES = ("pinion", "wheel")


def relieved(system, **values):
    side = FlankModification(**values)
    return replace(
        system,
        modification=PairModification(pinion=side, wheel=side),
    )


def ripple(system, faults=()):
    table = system.mesh_table(faults)
    roll = system.pair.base_pitch * (np.arange(256) + 0.5) / 256
    return np.ptp(
        static_mesh(table, pair_states(table, roll), system.mesh_force).approach
    )


def columns(table):
    return [
        getattr(side_of(table, side), name)
        for side in SIDES
        for name in ("compliance", "gap", "gap_slope")
    ]


def test_no_depth_is_no_relief_bit_for_bit(xiamen, machine):
    heights = {f"modification.{side}.tip_relief_height_mm": 0.6 for side in SIDES}
    plain = machine(
        {
            **heights,
            "modification.wheel.profile_shape": "parabolic",
        }
    )
    for mine, theirs in zip(
        columns(plain.mesh_table()),
        columns(xiamen.mesh_table()),
        strict=True,
    ):
        assert_array_equal(mine, theirs)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_the_gaps_are_those_of_the_fault_of_the_same_relief(xiamen, shape):
    """The fault falls off along the line of action, the modification over the radius: 4 % of the
    depth between them.
    """
    depth = 10 * UM
    height = 0.6 * MM
    system = relieved(
        xiamen,
        tip_relief=depth,
        tip_relief_height=height,
        profile_shape=shape,
    )
    faults = []
    for name in SIDES:
        gear = getattr(xiamen.pair, name)
        length = np.sqrt(gear.tip_radius**2 - gear.base_radius**2) - np.sqrt(
            (gear.tip_radius - height) ** 2 - gear.base_radius**2
        )
        words = {
            "relief_um": depth / UM,
            "relief_length_mm": length / MM,
            "relief_curve": shape,
        }
        faults.append(one("tip_relief", gear=name, tooth="all", **words))
    mine = system.mesh_table()
    theirs = xiamen.mesh_table(faults)
    for name in SIDES:
        relieved_side = side_of(mine, name)
        fault = side_of(theirs, name)
        assert set(relieved_side.kind) == {0}
        assert relieved_side.gap[0].max() > 0.9 * depth
        assert_close(
            relieved_side.gap[0],
            fault.gap[fault.kind[0]],
            atol=0.04 * depth,
        )


def test_back_flanks_are_modified_too(xiamen):
    system = relieved(xiamen, tip_relief=10 * UM, tip_relief_height=0.6 * MM)
    table = system.mesh_table((one("crack", gear="pinion", tooth=3),))
    rows = tooth_rows(table).values[:, 0]
    assert_array_equal(rows[0, :, 2], table.pairs.gap[0, 0, 0])
    assert rows[0, :, 2].max() > 9 * UM


def test_a_fault_comes_on_top(xiamen):
    """A pitch error adds itself to the relief."""
    system = relieved(xiamen, tip_relief=10 * UM, tip_relief_height=0.6 * MM)
    late = one("pitch_error", gear="wheel", tooth=5, pitch_error_um=7)
    side = side_of(system.mesh_table((late,)), "wheel")
    assert_close(
        side.gap[side.kind[5]],
        side.gap[0] + 7 * UM,
        atol=1e-3 * UM,
    )


def test_relief_of_the_deflection_takes_most_ripple_off(xiamen, machine):
    """One pair leaves as the next one enters: reliefs that sum to the deflection leave it
    even (Harris's map).
    """
    for system in (xiamen, machine({"operating.torque_nm": 60.0})):
        best = replace(system, modification=system.long_relief())
        assert ripple(best) < 0.2 * ripple(system)
        twice = {
            name: replace(side, tip_relief=2 * side.tip_relief)
            for name, side in sides(best)
        }
        deep = replace(system, modification=PairModification(**twice))
        assert ripple(deep) > 3 * ripple(best)
        # of teeth as cut, whatever is ground off
        assert best.long_relief() == best.modification
    with pytest.raises(GeometryError, match=r"contact ratio 0.9\d+ lies outside"):
        machine({"gear.addendum_coefficient": 0.5}).long_relief()
    with refused("gensig modify-flank"):
        machine({"system.kind": "helical_pair"}).long_relief()


def sides(system):
    return [(name, getattr(system.modification, name)) for name in SIDES]


@pytest.mark.parametrize(
    ("lead", "share"),
    [
        ({"crowning": 3 * UM}, 0.03),
        (
            {"end_relief": 10 * UM, "end_relief_width": 3 * MM},
            0.03,
        ),
        (
            {"helix_slope": 5 * UM},
            0.08,
        ),  # bears on part of the face, whose secant is taken at the set torque
    ],
)
def test_leads_are_those_of_the_sliced_pair(config_with, lead, share):
    """Mean deflection of both models of one pair; the spur table is a secant, the slices bear one
    by one.
    """
    config = config_with()
    spur = relieved(read_system(config), **lead)
    sliced = read_system(config.with_keys("system", kind="helical_pair"))
    sliced = replace(sliced, modification=spur.modification)
    roll = spur.pair.base_pitch * (np.arange(64) + 0.5) / 64
    table = spur.mesh_table()
    slices = sliced.mesh_table()
    spur_approach = static_mesh(
        table, pair_states(table, roll), spur.mesh_force
    ).approach.mean()
    theirs = static_mesh(
        slices, pair_states(slices, roll), spur.mesh_force
    ).approach.mean()

    assert_close(spur_approach, theirs, share)


def test_relieved_gears_shake_less_along_the_line_of_action(machine):
    """Tips that do not strike: a quarter of the acceleration along the line of action at the rated
    point.
    """
    system = machine(
        {
            "operating.duration_s": 0.2,
            "sensing.channels": ["pinion_y", "wheel_y"],
        }
    )
    runs = [
        Run(
            system=replace(system, modification=modification),
        )
        for modification in (PLAIN, system.long_relief())
    ]
    plain, quiet = (
        np.sqrt((record.acceleration**2).mean(axis=1))
        for record in simulate_together(runs)
    )

    assert (quiet < 0.5 * plain).all()
