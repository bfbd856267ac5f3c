"""What every fault must do to compliance and contact: nothing at severity zero, more with every step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.faults.base import faulty_teeth
from gensig.faults.crack import Crack
from gensig.faults.pitting import Pitting
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.pair_table import pair_compliance

GEARS = ("pinion", "wheel")


def crack(depth, gear="pinion", start="arc_mid", angle=np.pi / 4):
    return Crack(gear=gear, tooth=0, crack_depth=depth, crack_angle=angle, crack_start=start)


def pit(width=10e-3, length=1e-3, depth=0.5e-3, gear="pinion"):
    return Pitting(gear=gear, tooth=0, pit_length=length, pit_width=width, pit_depth=depth, pit_position=None)


NOTHING = {
    "crack_depth_arc": lambda gear: crack(0.0, gear),
    "crack_depth_gamma": lambda gear: crack(0.0, gear, "gamma_mid"),
    "pit_width": lambda gear: pit(width=0.0, gear=gear),
    "pit_length": lambda gear: pit(length=0.0, gear=gear),
}
LITTLE = {
    "crack_depth_arc": lambda gear: crack(0.5e-3, gear),
    "crack_depth_gamma": lambda gear: crack(0.5e-3, gear, "gamma_mid"),
    "pit_width": lambda gear: pit(width=2e-3, gear=gear),
    "pit_length": lambda gear: pit(length=0.3e-3, gear=gear),
}
SERIES = {
    "crack_depth_arc": [crack(d * 1e-3) for d in (0.3, 0.5, 1.0, 1.5, 2.0, 2.5)],
    "crack_depth_gamma": [crack(d * 1e-3, start="gamma_mid") for d in (0.3, 0.5, 1.0, 1.5, 2.0, 2.5)],
    "crack_depth_wheel": [crack(d * 1e-3, "wheel") for d in (0.3, 0.5, 1.0, 1.5, 2.0, 2.5)],
    "crack_angle": [crack(1e-3, angle=np.radians(a)) for a in (15, 30, 45, 60, 90)],
    "pit_width": [pit(width=w * 1e-3) for w in (1, 2, 4, 8, 12, 16, 19)],
    "pit_width_wheel": [pit(width=w * 1e-3, gear="wheel") for w in (1, 2, 4, 8, 12, 16, 19)],
}


def compliance(system, *faults):
    """Single-pair compliance of the faulty tooth along the path, and the gap of its side, (phase,)."""
    table = system.mesh_table(faults)
    gear = faults[0].gear
    side = table.pinion if gear == "pinion" else table.wheel
    position = np.linspace(0, system.pair.path_of_contact, 301)
    return pair_compliance(table, position, **{f"{gear}_kind": 1}), side.gap[1] - side.gap[0]


def sound(system):
    return pair_compliance(system.mesh_table(), np.linspace(0, system.pair.path_of_contact, 301))


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("kind", NOTHING)
def test_severity_zero_is_healthy(xiamen, kind, gear):
    fault = NOTHING[kind](gear)
    found, gap = compliance(xiamen, fault)
    assert fault.severity(getattr(xiamen.pair, gear)) == pytest.approx(0.0, abs=0.0)
    assert_allclose(gap, 0.0, rtol=0, atol=0)
    assert_allclose(found, sound(xiamen), rtol=1e-9, atol=0)


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("kind", LITTLE)
def test_a_little_is_not(xiamen, kind, gear):
    fault = LITTLE[kind](gear)
    assert fault.severity(getattr(xiamen.pair, gear)) > 0
    assert (compliance(xiamen, fault)[0] / sound(xiamen)).max() > 1 + 1e-3


@pytest.mark.parametrize("kind", SERIES)
def test_stiffness_falls_with_severity(xiamen, kind):
    found = np.array([sound(xiamen), *(compliance(xiamen, fault)[0] for fault in SERIES[kind])])
    steps = np.diff(found, axis=0)
    assert steps.min() >= -1e-9 * found.min()
    assert (steps.max(axis=1) > 1e-3 * found.min()).all() or kind == "crack_angle"
    severities = [fault.severity(getattr(xiamen.pair, fault.gear)) for fault in SERIES[kind]]
    assert kind == "crack_angle" or np.all(np.diff(severities) > 0)


@pytest.mark.parametrize(("start", "loss"), [("gamma_mid", 0.0281), ("arc_mid", 0.0403)])
def test_the_papers_crack_costs_what_its_formula_says(paper_machine, start, loss):
    # spur reference (docs/validation.md), section 2.3: loss of pair stiffness at the pitch point, 1 mm
    at = [np.array([paper_machine.pair.pitch_point])]
    faulty = pair_compliance(paper_machine.mesh_table((crack(1e-3, start=start),)), *at, pinion_kind=1)
    healthy = pair_compliance(paper_machine.mesh_table(), *at)
    assert_allclose(1 - healthy / faulty, loss, rtol=0, atol=2e-4)


def test_the_pit_costs_what_its_formula_says(paper_machine):
    at = [np.array([paper_machine.pair.pitch_point])]
    faulty = pair_compliance(paper_machine.mesh_table((pit(),)), *at, pinion_kind=1)
    assert_allclose(1 - pair_compliance(paper_machine.mesh_table(), *at) / faulty, 0.0574, rtol=0, atol=2e-4)


class TestTwoFaultsOnOneTooth:
    @pytest.mark.parametrize("faults", [(crack(1e-3), pit()), (pit(), crack(1e-3))])
    def test_softer_than_either(self, xiamen, faults):
        both = compliance(xiamen, *faults)[0]
        for fault in faults:
            assert np.all(both >= compliance(xiamen, fault)[0] * (1 - 1e-9))

    def test_order_hardly_matters(self, xiamen):
        one, other = (compliance(xiamen, *faults)[0] for faults in ((crack(1e-3), pit()), (pit(), crack(1e-3))))
        assert_allclose(one, other, rtol=0.02, atol=0)

    @pytest.mark.parametrize("order", [1, -1])
    def test_sections_stay_positive(self, xiamen, order):
        """Severities that the quickstart plan draws for each fault alone."""
        tooth = faulty_teeth(xiamen.pair, (crack(2.5e-3), pit(width=16e-3, length=1.5e-3))[::order])["pinion", 0]
        sound_tooth = healthy_tooth(xiamen.pair.pinion)
        for key in ("area", "second_moment"):
            assert np.all(getattr(tooth, key) > 0)
            assert np.all(getattr(tooth, key) <= getattr(sound_tooth, key))
