"""Faults as the other flank of the same tooth feels them."""

from dataclasses import dataclass, replace
from typing import ClassVar

import pytest
from fault_cases import KINDS, one

from gensig.faults.base import Fault, Growth

ON = {"gear": "wheel", "tooth": 3}


def test_what_pulls_a_crack_open_on_one_flank_presses_it_together_on_the_other():
    crack = one("crack", **ON)
    felt = crack.on_other_flank()
    assert (crack.crack_side, felt.crack_side) == ("tension", "compression")
    assert felt == replace(crack, crack_side="compression")
    assert felt.on_other_flank() == crack


@pytest.mark.parametrize("kind", KINDS)
def test_every_fault_answers_with_a_fault_of_the_same_teeth_or_none(kind):
    fault = one(kind)
    felt = fault.on_other_flank()
    if kind in ("crack", "chipped", "broken", "missing_tooth"):
        assert (type(felt), felt.gear, felt.tooth) == (
            type(fault),
            fault.gear,
            fault.tooth,
        )
    else:
        assert felt is None


def test_a_fault_that_does_not_answer_cannot_be_made():
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Silent(Fault):
        kind: ClassVar[str] = "silent"
        growth: ClassVar[Growth] = Growth.NONE

        def severity(self, gear):
            return 0.0

        def apply(self, tooth, number):
            return tooth

    with pytest.raises(TypeError, match=r"abstract method '?on_other_flank"):
        Silent(**ON)


def test_misalignment_alone_belongs_to_the_mounting_of_a_pair():
    assert [kind for kind in KINDS if one(kind).of_mounting] == ["misalignment"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_gone_is_gone_from_both_flanks_and_other_faults_stay_on_theirs(kind):
    fault = one(kind, **ON)
    felt = fault.on_other_flank()
    if kind in ("chipped", "broken", "missing_tooth"):
        assert felt is fault
    elif kind != "crack":
        assert felt is None
