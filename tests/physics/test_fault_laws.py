"""Laws of every fault for compliance and contact: nothing at severity zero, more with every
step.
"""

from functools import cache

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import (
    CASES,
    GEARS,
    KINDS,
    deflection,
    one,
    side_of,
)
from numpy.testing import assert_allclose

from gensig.faults.base import faulty_teeth
from gensig.faults.registry import FAULTS
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.tooth_sections import sections


def test_the_cases_are_all_faults():
    assert {case.kind for case in CASES.values()} == set(FAULTS) - {"missing_tooth"}


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("name", CASES)
def test_severity_zero_is_healthy(xiamen, name, gear):
    fault = CASES[name].fault(CASES[name].nothing, gear)
    assert_close(fault.severity(getattr(xiamen.pair, gear)), 0.0)

    table = xiamen.mesh_table((fault,))
    sound = xiamen.mesh_table()
    side = side_of(table, gear)
    sound_side = side_of(sound, gear)
    row = side.kind[0]
    for key in (
        "compliance",
        "gap",
        "compliance_slope",
        "gap_slope",
    ):
        result = getattr(side, key)[row]
        expected = getattr(sound_side, key)[0]
        assert_allclose(result, expected, rtol=0, atol=0, err_msg=key)

    assert side.present.all()


@pytest.fixture(scope="module")
def series(xiamen):
    """Deflection and severity from nothing on, (step, node) and (step,), by case and gear."""

    @cache
    def make(name, gear):
        case = CASES[name]
        body = getattr(xiamen.pair, gear)
        faults = [case.fault(value, gear) for value in (case.nothing, *case.rising)]
        deflections = np.array([deflection(xiamen, fault) for fault in faults])
        return deflections, np.array([fault.severity(body) for fault in faults])

    return make


def steps(found):
    """Change from each severity to the next, (step, node) m; nothing changes where no contact is
    left on either.
    """
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(
            np.diff(found, axis=0),
            nan=0.0,
            posinf=np.inf,
            neginf=-np.inf,
        )


def falls(found, slack):
    """True at places at which the deflection falls by more than the slack, (step, node)."""
    return steps(found) < -slack * found[:-1].clip(max=1.0)


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("name", CASES)
def test_more_of_it_shows_and_never_stiffens(series, name, gear):
    """Each step is seen somewhere: a nanometre is 1000 times above the rounding."""
    deflections, severity = series(name, gear)

    change = np.abs(steps(deflections)).max(axis=1)
    assert np.all(change > 1e-9), change

    if CASES[name].grows:
        assert not falls(deflections, CASES[name].slack).any()

    assert severity[0] == 0.0
    assert severity.max() <= 1.0

    rises = np.diff(severity)
    assert rises[0] > 0

    # the depth of a pit is no part of the pitted share
    if name == "pit_depth":
        assert np.all(rises >= 0)
    else:
        assert np.all(rises > 0)


@pytest.mark.parametrize("gear", GEARS)
class TestWhoseFacesBear:
    """The load of the drive flank presses a crack on the compression side together, whatever its
    severity.
    """

    def test_a_pressed_crack_that_breathes_costs_nothing(self, xiamen, gear):
        pressed = {
            "crack_side": "compression",
            "crack_faces": "breathing",
        }
        crack = one("crack", gear=gear, tooth=0, **pressed)
        result = deflection(xiamen, crack)

        assert_close(result, deflection(xiamen), 1e-12)
        assert crack.severity(getattr(xiamen.pair, gear)) > 0.2

    def test_on_the_tension_side_it_is_open(self, xiamen, gear):
        breathing, kept_open = (
            deflection(
                xiamen,
                one(
                    "crack",
                    gear=gear,
                    tooth=0,
                    crack_faces=faces,
                ),
            )
            for faces in ("breathing", "open")
        )
        assert_close(breathing, kept_open, 1e-12)
        assert (kept_open / deflection(xiamen)).max() > 1.02


class TestThePapersCrack:
    """Eqs. (11) and (12), chosen by ``mesh.crack=paper`` alone or with the rest of the paper's
    conventions.
    """

    @pytest.fixture(scope="class")
    @classmethod
    def cut(cls, machine):
        return machine({"mesh.crack": "paper"})

    @pytest.mark.parametrize("gear", GEARS)
    @pytest.mark.parametrize("start", ["arc_mid", "gamma_mid"])
    def test_rises_with_depth(self, cut, gear, start):
        faults = [
            one(
                "crack",
                gear=gear,
                tooth=0,
                crack_depth_mm=depth,
                crack_start=start,
            )
            for depth in (0.0, 0.3, 0.5, 1.0, 1.5, 2.0, 2.5)
        ]
        result = np.array([deflection(cut, fault) for fault in faults])
        assert not falls(result, 1e-9).any()
        assert np.all(steps(result).max(axis=1) > 1e-3 * result.min())


def lost_at_pitch_point(system, fault):
    """Share of the single pair's stiffness at C that a fault costs, gaps left out."""

    def compliance(table, kind):
        gears = (
            side_of(table, "pinion").compliance[kind],
            side_of(table, "wheel").compliance[0],
        )
        return sum(
            np.interp(system.pair.pitch_point, table.position, of_gear)
            for of_gear in gears
        )

    faulty = compliance(system.mesh_table((fault,)), 1)
    return 1 - compliance(system.mesh_table(), 0) / faulty


class TestThePapersPit:
    def test_slices_cost_the_same_where_the_pit_is_deeper_than_the_load(
        self, machine, paper_machine
    ):
        """The rest of the paper's conventions under the law with gaps: the pit's slices stand clear
        of the mate.
        """
        terms = {
            "elasticity": "plane_stress",
            "body": "sainsot",
            "tooth": "to_contact",
            "contact": "linear",
            "bending": "whole",
        }
        sliced = machine({f"mesh.{key}": value for key, value in terms.items()})
        assert sliced.mesh.law == "one_sided"

        result, expected = (
            lost_at_pitch_point(system, one("pitting"))
            for system in (sliced, paper_machine)
        )
        assert_close(result, expected, 1e-3)

        bridged = lost_at_pitch_point(sliced, one("pitting", pit_length_mm=0.02))
        assert bridged < 0.1 * result


class TestTwoFaultsOnOneTooth:
    CRACK, PIT = (one(kind, tooth=0) for kind in ("crack", "pitting"))

    @pytest.mark.parametrize(
        "faults",
        [(CRACK, PIT), (PIT, CRACK)],
        ids=["crack_pit", "pit_crack"],
    )
    def test_softer_than_either(self, xiamen, faults):
        both = deflection(xiamen, *faults)
        for fault in faults:
            assert np.all(both >= deflection(xiamen, fault) * (1 - 1e-9))
            assert (both / deflection(xiamen, fault)).max() > 1.01

    @pytest.mark.parametrize(
        "other",
        sorted(set(KINDS) - {"missing_tooth", "pitting"}),
    )
    def test_order_hardly_matters(self, xiamen, other):
        pair = (self.PIT, one(other, tooth=0))
        one_way, other_way = (
            deflection(xiamen, *faults) for faults in (pair, pair[::-1])
        )
        assert_close(one_way, other_way, 1e-4)
        assert np.abs(one_way / deflection(xiamen) - 1).max() > 0.005

    @pytest.mark.parametrize("order", [1, -1])
    def test_sections_stay_positive(self, machine, order):
        """Severities that the quickstart plan draws for each fault alone."""
        system = machine({"mesh.crack": "paper"})
        faults = (
            one("crack", tooth=0, crack_depth_mm=2.5),
            one(
                "pitting",
                tooth=0,
                pit_width_mm=16,
                pit_length_mm=1.5,
            ),
        )
        tooth = faulty_teeth(system.pair, faults[::order])["pinion", 0]
        sound = sections(healthy_tooth(system.pair.pinion), papers_crack=True)
        for result, whole in zip(
            sections(tooth, papers_crack=True),
            sound,
            strict=True,
        ):
            assert np.all(result > 0)
            assert np.all(result <= whole)
