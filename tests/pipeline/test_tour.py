"""docs/tour.ipynb: its cells run from first to last in one process and show what its text says.

The cells are plain Python, so that no notebook server is needed. Their stored outputs come from
the same run.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "docs" / "tour.ipynb"
CELLS = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
CODE = ["".join(cell["source"]) for cell in CELLS if cell["cell_type"] == "code"]
CHECKS = """
assert all(a > b for a, b in zip([stiffness[d].mesh_stiffness.min() for d in DEPTHS],
                                 [stiffness[d].mesh_stiffness.min() for d in DEPTHS[1:]]))
assert abs(crack(0.8)[0].severity(system.pair.pinion) - 0.8) < 1e-3
assert all(side[a] < side[b] for a, b in zip(DEPTHS, DEPTHS[1:]))
assert max(rms.values()) < 1.02 * min(rms.values())
assert added < sound.max() - sound.min()
ripple = {name: values.max() - values.min() for name, values in one_period.items()}
assert ripple["helical 61/132"] < 0.2 * ripple["spur 23/84"]
assert units[0].isdisjoint(units[2]) and units[1].isdisjoint(units[2])
assert 0.1 < shuffled < 0.35 < low
assert found[0] > 0.5 and found[3] > 0.7
"""


OUTPUTS = [output for cell in CELLS for output in cell.get("outputs", [])]
STORED = "".join("".join(output.get("text", [])) for output in OUTPUTS)
PHYSICS = re.compile(r"A crack|crack +\d+%|sidebands|spur|helical")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Output of all cells, once the checks of what they computed have passed."""
    folder = tmp_path_factory.mktemp("tour")
    (folder / "tour.py").write_text("\n".join([*CODE, CHECKS]), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", "tour.py"],
        cwd=folder,
        env=os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=3600,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    # nothing is left behind
    assert [path.name for path in folder.iterdir()] == ["tour.py"]
    return done.stdout


def test_it_runs_and_the_figures_in_its_outputs_are_still_true(printed):
    now, then = (
        [
            [float(number) for number in re.findall(r"\d+\.?\d*", line)]
            for line in text.splitlines()
            if PHYSICS.match(line)
        ]
        for text in (printed, STORED)
    )
    assert len(then) == 9
    for new, old in zip(now, then, strict=True):
        assert new == pytest.approx(old, rel=0.02, abs=2e-3)


def test_its_outputs_are_small_and_name_no_folder_of_a_machine():
    assert NOTEBOOK.stat().st_size < 600_000
    assert sum("image/png" in output.get("data", {}) for output in OUTPUTS) == 4
    assert not re.search(r"/(tmp|home|root|Users)/", STORED)
    assert "error" not in {output["output_type"] for output in OUTPUTS}
