"""Faults as the other flank of the same tooth feels them."""

import math
from dataclasses import dataclass
from typing import ClassVar

import pytest
from fault_cases import KINDS, one

from gensig.faults.base import Fault, Growth
from gensig.faults.broken import BrokenTooth, ChippedTooth, MissingTooth
from gensig.faults.crack import Crack
from gensig.faults.flank_form import PitchError, Wear
from gensig.faults.pitting import Pitting

ON = {"gear": "wheel", "tooth": 3}


@pytest.mark.parametrize(
    "fault",
    [
        MissingTooth(**ON),
        BrokenTooth(**ON, broken_height=1e-3),
        ChippedTooth(**ON, chip_height=1e-3, chip_width=5e-3),
    ],
)
def test_what_is_gone_is_gone_from_both_flanks(fault):
    assert fault.on_other_flank() is fault


def test_what_pulls_a_crack_open_on_one_flank_presses_it_together_on_the_other():
    crack = Crack(
        **ON, crack_depth=1e-3, crack_angle=math.radians(70.0), crack_start="arc_mid"
    )
    felt = crack.on_other_flank()
    assert (crack.crack_side, felt.crack_side) == ("tension", "compression")
    assert (felt.crack_depth, felt.tooth) == (crack.crack_depth, crack.tooth)
    assert felt.on_other_flank() == crack


def test_what_is_of_a_flank_stays_with_it():
    pit = Pitting(**ON, pit_length=1e-3, pit_width=2e-3, pit_depth=1e-4)
    for fault in (
        pit,
        PitchError(**ON, pitch_error=5e-6, limit=1e-4),
        Wear(**ON, wear_depth=1e-5, limit=1e-4),
    ):
        assert fault.on_other_flank() is None


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
