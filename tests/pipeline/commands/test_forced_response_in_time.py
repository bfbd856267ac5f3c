"""The verb forced-response in time from the command line: tooth loads, root stress and dampers, sweeps."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.cli import main

ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
DAMPERS = (
    "system.dampers=[{node: 21, ring_inertia_kg_m2: 0.01539, damping_nms_per_rad: 6.161, stiffness_nm_per_rad: 245900},"
    "{node: 45, ring_inertia_kg_m2: 0.01138, damping_nms_per_rad: 4.763, stiffness_nm_per_rad: 143100}]"
)


def test_loads_spectra_root_stress_and_a_sweep_are_written_and_drawn(tmp_path, capsys):
    out, figure = tmp_path / "found.json", tmp_path / "found.png"
    words = [
        *ENGINE,
        DAMPERS,
        "--nodes",
        "14",
        "--time",
        "0.6",
        "--mesh",
        "45",
        "21",
        "--sweep",
        "1500",
        "1750",
        "0.8",
    ]
    assert (
        main(["forced-response", *words, "--json", str(out), "--plot", str(figure)])
        == 0
    )
    content, printed = json.loads(out.read_text()), capsys.readouterr().out
    drive = content["meshes"].index("21/45")
    # a cycle has no more than the whole run, and rattling more than the linear line
    greatest = content["time_typical_greatest_tooth_force_n"]
    assert len(greatest) == 8
    assert np.all(np.array(greatest) <= content["time_greatest_tooth_force_n"])
    assert greatest[drive] > content["greatest_tooth_force_n"][drive]
    assert (
        content["time_typical_fluctuation_rpm"][0]
        <= content["time_speed_fluctuation_rpm"][0]
    )
    # order 1 leads at the flywheel, with the linear line's amplitude
    assert content["time_orders"][:3] == [0.5, 1.0, 1.5]
    assert_allclose(
        content["time_angle_deg"][0][1], content["angle_deg"][0][1], rtol=0.1
    )
    roots = content["root_stress"]
    assert content["root_stress_mesh"] == "21/45"
    assert set(roots) == {
        "linear",
        "in_time",
        "linear_without_dampers",
        "in_time_without_dampers",
    }
    for name in ("linear", "in_time"):
        before, after = roots[f"{name}_without_dampers"], roots[name]
        assert after["iso_root_stress_mpa"] < before["iso_root_stress_mpa"]
        assert after["safety_factor_paper"] > before["safety_factor_paper"]
        assert after["largest_root_stress_mpa"] < after["iso_root_stress_mpa"]
    assert roots["in_time"]["greatest_tooth_force_n"] == pytest.approx(greatest[drive])
    assert "by the dampers" in printed
    assert (
        "reliability: high from 2.00 on, higher from 1.60 on, general from 1.25 on, low from 1.00 on"
        in printed
    )
    n_speeds = len(content["sweep_speeds_rpm"])
    for way in ("sweep_up", "sweep_down"):
        assert np.shape(content[way]["angle_deg"]) == (
            1,
            n_speeds,
            len(content["sweep_orders"]),
        )
        assert np.shape(content[way]["typical_greatest_tooth_force_n"]) == (8, n_speeds)
        assert np.all(np.array(content[way]["speed_fluctuation_rpm"]) > 0.0)
    assert np.all(np.diff(content["sweep_speeds_rpm"]) > 0.0)
    assert "sweep up and down, 0.8 s each way" in printed
    assert figure.stat().st_size > 100_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--sweep", "900", "700", "5"],
            "--sweep 900 700 5: give low and high speed in r/min and the seconds",
        ),
        (
            ["--sweep", "650", "1750", "0"],
            "--sweep 650 1750 0: give low and high speed",
        ),
        (
            ["--sweep", "650", "1750", "0.3"],
            "passes too few cycles at its low end; give 0.81 s or more",
        ),
        (["--time", "0.01"], "less than a cycle of two turns; simulate longer"),
        (["--mesh", "3", "45"], "nodes 3 and 45 do not mesh; these do: 3/18"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, message, capsys):
    assert main(["forced-response", *ENGINE, "--nodes", "14", *words]) != 0
    error = capsys.readouterr().err.strip()
    assert message in error
    assert "\n" not in error
