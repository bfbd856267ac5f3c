"""Form and stress correction factors of ISO 6336-3 against the stored finite elements of
``tests/reference``."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from closeness import assert_close
from reference.calibrate_crack import reference_gear

from gensig.life.root.tooth_root import root_loading

FILE = Path(__file__).parents[2] / "reference" / "data" / "root_stress.csv"
CASES = (
    "z17_x03",
    "z23",
    "z25_sharp",
    "z30_alpha25",
    "z30_long",
    "z40",
    "z54",
    "z84",
)


def compared(case):
    """Places from the tip in base pitches, our factor over F / (b m), and that of finite
    elements."""
    with FILE.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["case"] == case]
    gear = reference_gear(rows[0])
    place, exact = (
        np.array([float(row[key]) for row in rows])
        for key in (
            "tip_distance_over_base_pitch",
            "stress_factor",
        )
    )
    ours = root_loading(gear, place * gear.base_pitch).stress_factor * math.cos(
        gear.pressure_angle
    )
    return place, ours, exact, rows


@pytest.mark.parametrize("case", CASES)
def test_iso_is_near_finite_elements_where_it_takes_the_load(case):
    """Between the tip and the outer point of single contact; lower down its fixed section sees too
    little."""
    place, ours, exact, _ = compared(case)
    high = place < 0.8
    assert_close(ours[high], exact[high], 0.105)
    assert np.all(np.diff(exact) < 0.0)
    assert np.all(np.diff(ours) < 0.0)
    assert ours[-1] / exact[-1] < np.min(ours[high] / exact[high])


def test_the_pump_drives_gear_at_isos_load_point():
    place, ours, exact, _ = compared("z54")
    assert_close(
        np.interp(0.768, place, ours),
        np.interp(0.768, place, exact),
        0.04,
    )


def test_the_critical_section_is_where_the_tension_is_largest_under_a_high_load():
    for case in CASES:
        _, _, _, rows = compared(case)
        assert_close(float(rows[0]["tangent_deg"]), 30.0, atol=6.5)
