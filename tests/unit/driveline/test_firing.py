"""Firing of cylinders: even firing of the 20-cylinder engine, and layouts that cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from engine_cases import IN_SEQUENCE, option, with_throws
from numpy.testing import assert_allclose
from refusals import refused

from gensig.driveline.excitation.engine import read_engine
from gensig.driveline.excitation.firing import Layout

V20 = read_engine(option()).layout


def gaps(layout):
    angles = np.degrees(list(layout.firing_angles().values()))
    return np.mod(np.diff(np.append(angles, angles[0])), 720.0)


def test_twenty_cylinders_fire_every_36_degrees_once():
    assert_allclose(gaps(V20), 36.0, atol=1e-9)
    angles = V20.firing_angles()
    assert sorted(angles) == sorted(V20.cylinders)
    assert_allclose(
        np.sort(np.degrees(list(angles.values()))), 36.0 * np.arange(20), atol=1e-9
    )


def test_bank_a_uses_the_stated_slots_and_bank_b_follows_by_72_degrees():
    angles = {name: np.degrees(angle) for name, angle in V20.firing_angles().items()}
    slots = sorted(
        round(angle / 36.0) for name, angle in angles.items() if name[0] == "A"
    )
    assert slots == [0, 1, 4, 5, 8, 9, 12, 13, 16, 17]
    for throw in range(1, 11):
        assert_allclose(
            (angles[f"B{throw}"] - angles[f"A{throw}"]) % 720.0, 72.0, atol=1e-9
        )


def test_every_cylinder_fires_at_its_own_top_dead_center():
    for name, angle in V20.firing_angles().items():
        assert_allclose(np.cos(angle - V20.dead_center(name)), 1.0, atol=1e-12)


def test_the_default_crank_has_no_first_order_couple_and_that_in_sequence_has():
    place = np.arange(10) - 4.5

    def couple(layout, order):
        return abs(np.sum(place * np.exp(1j * order * np.array(layout.throw_angles))))

    in_sequence = read_engine(with_throws(option(), IN_SEQUENCE)).layout
    assert couple(V20, 1) < 1e-12
    assert couple(V20, 2) < 0.9
    assert couple(in_sequence, 1) > 5.0


def test_a_bank_angle_of_90_fires_18_and_54_degrees_apart():
    order = V20.firing_order
    layout = replace(V20, bank_angles=(0.0, np.radians(90.0)), firing_order=order)
    computed = np.sort(np.unique(gaps(layout).round(6)))
    assert_allclose(computed, [18.0, 36.0, 54.0], atol=1e-6)


def test_a_parallel_twin_and_a_single_fire_a_turn_and_two_apart():
    twin = Layout(
        banks=("A",),
        bank_angles=(0.0,),
        throw_angles=(0.0, 0.0),
        firing_order=("A1", "A2"),
    )
    assert_allclose(gaps(twin), 360.0)
    single = Layout(
        banks=("A",), bank_angles=(0.0,), throw_angles=(0.5,), firing_order=("A1",)
    )
    assert_allclose(single.firing_angles()["A1"], 0.5)


def test_five_pairs_of_throws_72_degrees_apart_fire_two_at_a_time():
    throws = tuple(np.radians(72.0 * (throw % 5)) for throw in range(10))
    order = []
    for turn in range(2):
        for place in range(5):
            order += [f"A{place + 1 + 5 * turn}", f"B{(place - 1) % 5 + 1 + 5 * turn}"]
    with refused(
        "A1 and B5 fire together with these bank_angles_deg and throw_angles_deg"
    ):
        replace(V20, throw_angles=throws, firing_order=tuple(order))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"firing_order": (*V20.firing_order[:-1], "A1")},
            "firing_order repeats A1 (places 1 and 20); every cylinder fires once a cycle",
        ),
        (
            {"firing_order": V20.firing_order[:-1]},
            "firing_order lacks B7; every cylinder fires once",
        ),
        (
            {"firing_order": ("C1", *V20.firing_order[1:])},
            "no cylinder 'C1' (place 1); there are A1 to B10",
        ),
        ({"firing_order": V20.firing_order[::-1]}, "firing_order takes 6480 degrees"),
        ({"bank_angles": (0.0, 0.0)}, "firing_order takes 2520 degrees"),
        (
            {
                "bank_angles": (0.0, 0.0),
                "firing_order": tuple(
                    f"{bank}{one[1:]}"
                    for one in V20.firing_order
                    if one[0] == "A"
                    for bank in "AB"
                ),
            },
            "A1 and B1 fire together",
        ),
        ({"bank_angles": (0.0,)}, "bank_angles_deg has 1 values for 2 banks"),
        ({"banks": ("A", "A")}, "name at least one bank, each once"),
        ({"throw_angles": ()}, "throw_angles_deg is empty"),
    ],
)
def test_layouts_that_cannot_be_are_refused(change, message):
    with refused(message):
        replace(V20, **change)


def test_two_throws_are_one_within_a_hundredth_of_a_degree():
    def twin(degrees):
        return Layout(
            banks=("A",),
            bank_angles=(0.0,),
            throw_angles=(0.0, np.radians(degrees)),
            firing_order=("A1", "A2"),
        )

    assert_allclose(gaps(twin(0.005)), 360.0, atol=0.01)
    with refused("takes 360 degrees"):
        twin(0.1)
