"""What of a fault the other flank of the same tooth feels."""

import math

import pytest

from gensig.faults.broken import BrokenTooth, ChippedTooth, MissingTooth
from gensig.faults.crack import Crack
from gensig.faults.flank_form import PitchError, Wear
from gensig.faults.other_flank import on_other_flank
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
    assert on_other_flank(fault) is fault


def test_what_pulls_a_crack_open_on_one_flank_presses_it_together_on_the_other():
    crack = Crack(**ON, crack_depth=1e-3, crack_angle=math.radians(70.0), crack_start="arc_mid")
    felt = on_other_flank(crack)
    assert (crack.crack_side, felt.crack_side) == ("tension", "compression")
    assert (felt.crack_depth, felt.tooth) == (crack.crack_depth, crack.tooth)
    assert on_other_flank(felt) == crack


def test_what_is_of_a_flank_stays_with_it():
    pit = Pitting(**ON, pit_length=1e-3, pit_width=2e-3, pit_depth=1e-4)
    for fault in (pit, PitchError(**ON, pitch_error=5e-6, limit=1e-4), Wear(**ON, wear_depth=1e-5, limit=1e-4)):
        assert on_other_flank(fault) is None
