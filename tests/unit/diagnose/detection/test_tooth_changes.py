"""Change of a shaft's turn against healthy ones."""

import numpy as np
from numpy.random import default_rng

from diagnose.detection.tooth_changes import turn_change


def test_a_change_is_that_of_its_channel():
    sound = default_rng(0).standard_normal((2, 640))
    changed = sound.copy()
    changed[1, 100:120] += 5.0
    quiet, loud = turn_change(changed, [sound], 20).share_db
    assert loud > quiet + 20.0
    assert np.isfinite(loud)
