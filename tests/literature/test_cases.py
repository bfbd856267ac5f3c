"""The machines that rows speak of are those that ``gensig`` composes."""

import numpy as np
import pytest
from fault_cases import side_of
from numpy.testing import assert_allclose
from validation.case import read_case, with_fault, with_words

from gensig.errors import ConfigError
from gensig.options.compose import compose
from gensig.systems.registry import read_system


@pytest.mark.parametrize(
    "words",
    [
        (),
        (
            "mesh.law=paper",
            "mesh.contact=linear",
            "gear.pinion.bore_radius_mm=12.5",
            "mesh.body=ring",
        ),
        (
            "operating.speed_rpm=300",
            "sensing.sampling_rate_hz=51060",
            "material.youngs_modulus_gpa=205",
        ),
        ("gear.rated_torque_nm=10",),
        ("gear=xiamen_23_84", "mesh.law=paper"),
    ],
)
def test_a_typed_machine_is_the_composed_one(words):
    assert read_case(words).system == read_system(compose("generate", words))


@pytest.mark.parametrize(
    "word", ["mesh.lawn=paper", "gear.pinyon.bore_radius_mm=9", "mesh.law=papers"]
)
def test_mistakes_are_answered(word):
    with pytest.raises(ConfigError):
        _ = read_case((word,)).system


def test_the_last_word_counts():
    case = with_words(
        read_case(("mesh.law=paper", "fault=crack")), "mesh.law=one_sided"
    )
    assert case.system.mesh.law == "one_sided"
    assert case.faults
    assert not with_fault(case).faults


def test_one_pair_that_carries_all_is_stiffer_where_contact_hangs_on_load():
    linear, weber = (
        read_case((f"mesh.contact={contact}",)) for contact in ("linear", "weber")
    )
    tables = linear.whole_load_table, linear.table
    for one, other in zip(*(table.parts for table in tables), strict=True):
        assert_allclose(one.compliance, other.compliance, rtol=0)
    position, zone = (
        weber.table.position,
        weber.pair.path_of_contact - weber.pair.base_pitch,
    )
    whole, shared = (
        side_of(table, "pinion").compliance[0]
        for table in (weber.whole_load_table, weber.table)
    )
    alone = np.abs(position - weber.position("C")) < 1e-4
    two = (position > 0.05 * zone) & (position < 0.95 * zone)
    assert_allclose(whole[alone], shared[alone], rtol=1e-6)
    assert np.all(whole[two] < 0.99 * shared[two])
