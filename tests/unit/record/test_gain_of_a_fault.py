"""The gain of a fault, on motions of a few samples: `gensig.record.fault_gain`."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import SimulationError
from gensig.record.fault_gain import needs_sound, with_fault_gain
from gensig.systems.run import CleanRecord


def inputs(faults, gain):
    """Inputs of a record, as far as the law reads them."""
    sensing = SimpleNamespace(fault_gain=gain)
    machine = SimpleNamespace(sensing=sensing)
    return SimpleNamespace(run=SimpleNamespace(faults=faults), machine=machine)


def motion(*values):
    return CleanRecord(
        acceleration=np.array([values], dtype=float),
        shaft_angle=np.arange(float(len(values))),
        mean_speed=10.0,
        contact_loss_fraction=0.0,
        integration_error=0.0,
        integration_check="passed",
    )


FAULTY, SOUND = motion(1.0, 4.0), motion(1.0, 2.0)


@pytest.mark.parametrize(
    ("faults", "gain", "needed"),
    [
        ((), 1.0, False),
        ((), 2.0, False),
        (("crack",), 1.0, False),
        (("crack",), 2.0, True),
        (("crack",), 0.0, True),
    ],
)
def test_a_twin_is_asked_for_where_a_fault_has_another_gain(faults, gain, needed):
    given = inputs(faults, gain)
    assert needs_sound(given) is needed
    changed = with_fault_gain(given, FAULTY, SOUND)
    assert (changed is FAULTY) is not needed


@pytest.mark.parametrize(
    ("gain", "expected"), [(0.0, [1.0, 2.0]), (0.5, [1.0, 3.0]), (3.0, [1.0, 8.0])]
)
def test_what_the_fault_adds_is_scaled_and_the_rest_is_the_faulty_motion(
    gain, expected
):
    changed = with_fault_gain(inputs(("crack",), gain), FAULTY, SOUND)
    assert_allclose(changed.acceleration, [expected])
    assert changed.shaft_angle is FAULTY.shaft_angle


def test_an_error_of_either_motion_is_the_result():
    error, other = SimulationError("no bound"), SimulationError("another")
    given = inputs(("crack",), 2.0)
    assert with_fault_gain(given, error, other) is error
    assert with_fault_gain(given, FAULTY, other) is other
    assert with_fault_gain(inputs((), 2.0), FAULTY, other) is FAULTY
