"""Distinct teeth in the tables of the compiled core: sums by pair, or single teeth if many."""

import numpy as np
import pytest
from closeness import assert_close
from core_runs import CLASSICAL, PAPER, CoreRun
from fault_cases import GEARS, one, side_of
from lane_tools import laws

from gensig.dynamics import lanes
from gensig.dynamics._vector import LANES, n_lanes
from gensig.dynamics.backends.nystroem.machine_lanes import missing_cells, pack
from gensig.faults.broken import MissingTooth

LAWS = {
    "one_sided": {},
    "classical": CLASSICAL,
    "paper": PAPER,
}
PITS = tuple(
    one(
        "pitting",
        gear=gear,
        tooth=tooth,
        pit_width_mm=3.0 + 2.0 * tooth,
    )
    for gear, n_teeth in (("pinion", 5), ("wheel", 6))
    for tooth in range(n_teeth)
)
FAULTS = (*PITS, MissingTooth(gear="wheel", tooth=20))
N_PINION, N_WHEEL = 6, 8  # distinct teeth with the sound ones


@pytest.fixture(scope="module", params=LAWS)
def running(request, machine, running_of):
    errors = np.random.default_rng(3).normal(0, 2e-6, 84)
    system = machine({**LAWS[request.param], "gear.backlash_um": 10})
    return running_of(
        system,
        FAULTS,
        pinion_error=errors[:23],
        wheel_error=errors,
    )


@pytest.fixture(scope="module")
def motions(running):
    """Instants over more turns than a wheel has, driven and coasting."""
    rng = np.random.default_rng(9)
    n = 4000
    roll = running.table.pair.base_pitch * rng.uniform(-200, 200, n)
    approach = rng.uniform(-4e-5, 4e-5, n)
    rate = 1e-3 * rng.standard_normal(n)
    return np.column_stack([roll, approach, rate, rng.uniform(2, 6, n)])


def both_layouts(make, monkeypatch):
    """Results with the teeth summed by pair, and one by one."""
    results = []
    for most_pairs in (np.inf, 0):
        monkeypatch.setattr(lanes, "MOST_PAIRS", most_pairs)
        results.append(make())
    return results


def test_many_products_are_stored_tooth_by_tooth(xiamen, running_of, running):
    per_row = LANES * 4 * running.table.position.size
    few = running_of(xiamen, PITS[:5])
    end = len(missing_cells())
    assert len(pack([few.dynamics], 1e-6).table) == per_row * 6 + end
    n_rows = N_PINION + N_WHEEL
    assert len(pack([running.dynamics], 1e-6).table) == per_row * n_rows + end


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_every_pair_of_teeth_has_the_sum_of_its_tables(running, precision, monkeypatch):
    """Compliance, gap and slopes at every node; a missing pair stands after the last lane's."""
    monkeypatch.setattr(lanes, "MOST_PAIRS", np.inf)
    table, end = running.table, missing_cells()
    packed = pack([running.dynamics], 1e-6, precision).table
    teeth = lanes.tooth_rows(table)
    values = packed[: -len(end)].reshape(n_lanes(precision), -1, table.position.size, 4)
    sound = np.arange(84) != 20
    for column, name in enumerate(
        ("compliance", "compliance_slope", "gap", "gap_slope")
    ):
        sides = (side_of(table, gear) for gear in GEARS)
        pinion, wheel = (getattr(side, name)[side.kind] for side in sides)
        for lane in (0, -1):
            result = values[lane, :, :, column]
            for tooth in (0, 4, 22):
                row = teeth.pinion_stride * teeth.row[tooth] + teeth.row[23:][sound]
                expected = pinion[tooth] + wheel[sound]
                np.testing.assert_array_equal(result[row], expected.astype(precision))
    assert teeth.row[23 + 20] == -1
    np.testing.assert_array_equal(packed[-len(end) :], end.astype(precision))


def test_both_layouts_give_one_law_and_motion(running, motions, monkeypatch):
    def walk():
        run = CoreRun([running.dynamics], 1 / (51200 * 5))
        return (
            laws(running, motions),
            run.means(1500),
            run.whole,
        )

    by_pair, by_tooth = both_layouts(walk, monkeypatch)
    for column, expected in zip(by_tooth[0].T, by_pair[0].T, strict=True):
        assert_close(
            column,
            expected,
            1e-12,
            atol=1e-12 * np.abs(expected).max(),
        )
    for values, expected in zip(by_tooth[1:], by_pair[1:], strict=True):
        assert_close(values, expected, atol=1e-9 * np.abs(expected).max())

    assert (by_pair[0][:, 0] > 0).mean() > 0.2
    assert (by_pair[0][:, 0] < 0).mean() > 0.2
