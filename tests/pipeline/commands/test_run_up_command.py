"""Run-ups by ``gensig simulate``: figure, table of orders, refusals."""

import json
import re

import h5py
import numpy as np
import pytest

from gensig.commands.figures.run_up_figure import run_up_figure
from gensig.commands.gears.run_up import Mode, RunUp
from gensig.signals.run_up.level_map import LevelMap

RAMP = (
    "simulate operating=ramp operating.duration_s=1 sensing.channels=[pinion_y,wheel_y]"
)
ENGINE = (
    "simulate system=engine_gear_train excitation=engine_v20 operating=ramp "
    "operating.duration_s=5 operating.speed_rpm=1750"
)
N_TEETH = 23


def test_a_run_up_is_drawn_and_written(gensig, drawn, tmp_path):
    printed = gensig(f"{RAMP} --plot r.png --orders r.csv --output r.h5").out
    assert f"order {N_TEETH}, mesh: " in printed
    orders, waterfall, cuts = [title for title in drawn[0] if title]
    assert orders.startswith("Order map")
    assert waterfall.startswith("Waterfall (dashed: natural frequencies")
    assert cuts.startswith("Order cuts")
    assert drawn[0][orders].get_xlabel() == "order of the pinion"
    assert drawn[0][waterfall].get_xlabel() == "frequency, Hz"
    levels = "RMS level, dB re 10$^{-6}$ m/s$^2$"
    assert drawn[0][cuts].get_ylabel() == levels
    table = np.genfromtxt(tmp_path / "r.csv", delimiter=",", names=True)
    assert np.all(np.diff(table["speed_rpm"]) > 0.0)
    mesh, beside = (
        table[f"order_{order}_m_per_s2"] for order in (N_TEETH, N_TEETH + 3)
    )
    assert np.all(mesh > 2.0 * beside)
    assert np.all(table["total_m_per_s2"] > mesh)


def test_the_figure_leaves_the_samples_as_they_are(gensig, drawn, tmp_path):
    gensig(f"{RAMP} --output plain.h5")
    gensig(f"{RAMP} --output drawn.h5 --plot r.png")
    with (
        h5py.File(tmp_path / "plain.h5") as plain,
        h5py.File(tmp_path / "drawn.h5") as other,
    ):
        assert set(plain) == set(other)
        np.testing.assert_array_equal(plain["acceleration"], other["acceleration"])


def test_the_orders_of_an_engine_peak_where_they_meet_a_natural_frequency(
    gensig, drawn, tmp_path
):
    """Order 4 of the crank passes the second torsional mode, 69 Hz, in the run-up."""
    printed = gensig(f"{ENGINE} --plot e.png --orders e.csv").out
    modes = printed.split("natural frequencies, Hz: ")[1].split(", ")
    second = float(modes[1].removeprefix("f2 "))
    table = np.genfromtxt(tmp_path / "e.csv", delimiter=",", names=True)
    highest = table["speed_rpm"][table["order_4_rad_per_s"].argmax()]
    assert 4.0 * highest / 60.0 == pytest.approx(second, rel=0.05)
    assert next(iter(drawn[0].values())).get_xlabel() == "order of the crank"


@pytest.mark.parametrize("n_modes", [1, 11, 12, 40])
def test_every_natural_frequency_is_listed_or_counted(n_modes):
    modes = [
        Mode(name=f"f{index}", frequency=10.0 * index, damping_ratio=0.02)
        for index in range(1, n_modes + 1)
    ]
    levels = LevelMap(
        time=np.arange(3.0),
        speed=np.array([10.0, 20.0, 30.0]),
        axis=np.arange(5.0),
        rms=np.ones((3, 5)),
        total=np.ones(3),
        resolution=1.0,
    )
    run_up = RunUp(
        channel="pinion_y",
        shaft="pinion",
        orders=levels,
        waterfall=levels,
        cuts={"turn": 1.0},
        modes=tuple(modes),
    )
    figure = run_up_figure(run_up, "a run-up")
    key = figure.rows[0][-1].marks[-1].values[0]
    assert key.startswith("natural frequencies, Hz")
    listed = [mode.name for mode in modes if f"\n{mode.name}  " in key]
    left = re.search(r"\nand (\d+) more to (\d+)$", key)
    assert listed == [mode.name for mode in modes[: len(listed)]]
    assert len(listed) + int(left[1] if left else 0) == n_modes
    assert not left or float(left[2]) == modes[-1].frequency
    assert figure.title == "a run-up: pinion_y, pinion from 95 to 286 r/min"


def test_too_short_a_run_up_is_drawn_as_a_constant_speed_and_told(gensig, drawn):
    line = "simulate operating=ramp operating.duration_s=0.2 --plot r.png"
    message = gensig(line).err
    assert message.count("\n") == 1
    assert "the record has 4.42 turns of the shaft; orders over speed need 8" in message
    assert len(drawn[0]) == 3
    assert any(title.startswith("Envelope spectrum") for title in drawn[0])


VARIANTS = "run-up operating=ramp operating.duration_s=1 sensing.channels=[pinion_y]"


def test_a_variant_that_is_the_same_machine_changes_nothing(gensig, drawn, tmp_path):
    """Its twin, a missing tooth, is louder at every speed."""
    printed = gensig(
        f"{VARIANTS} --against seed=0 fault=missing_tooth --json v.json --plot v.png"
    ).out
    assert "seed=0: +0.00 dB on average" in printed
    content = json.loads((tmp_path / "v.json").read_text())
    assert np.all(np.diff(content["speeds_rpm"]) > 0.0)
    same, louder = (
        np.array(content["total_change_db"][name], dtype=float)
        for name in ("seed=0", "fault=missing_tooth")
    )
    assert np.all(same == 0.0)
    assert np.nanmin(louder) > 1.0
    levels = content["mesh_level_db"]["as configured"]
    rms = np.array(content["mesh_rms_m_per_s2"]["as configured"])
    np.testing.assert_allclose(levels, 20.0 * np.log10(rms / 1e-6))
    assert len(drawn[0]) == 4
