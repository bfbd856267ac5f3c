"""Verbs on drive lines: modes, forced-response, tune-damper."""

from importlib import resources

import numpy as np
import pytest
from engine_cases import option, response_of
from figure_labels import labels
from numpy.testing import assert_allclose

TRAIN = "system=engine_gear_train"
ENGINE = f"forced-response {TRAIN} excitation=engine_v20"
RPM = np.pi / 30.0
SIZES = "ring_inertia_kg_m2: {}, damping_nms_per_rad: {}, stiffness_nm_per_rad: {}"
DAMPERS = (
    f"'system.dampers=[{{node: 21, {SIZES.format(0.01539, 6.161, 245900)}}},"
    f"{{node: 45, {SIZES.format(0.01138, 4.763, 143100)}}}]'"
)


def frequencies(content, n):
    return content["natural_frequencies_hz"][:n]


def test_modes_writes_what_it_promises(written, capsys):
    content = written(f"modes {TRAIN}")
    expected = [0.0, 28.31, 68.72, 162.06, 215.97]
    assert_allclose(frequencies(content, 5), expected, rtol=0, atol=0.005)
    assert frequencies(content, 1) == content["damping_ratio"][:1] == [0.0]
    assert content["n_rigid_modes"] == 1
    shares, shapes = content["kinetic_energy_share"], content["shapes"]
    assert np.shape(shapes) == np.shape(shares) == (67, 67)
    assert len(content["nodes"]) == len(content["natural_frequencies_hz"]) == 67
    assert_allclose(np.sum(shares, axis=1), 1.0, rtol=1e-9)
    assert_allclose(np.max(np.abs(shapes), axis=1), 1.0, rtol=1e-12)
    ratio = content["speed_ratio"]
    assert (ratio[44], ratio[19], ratio[17]) == (-0.5, 0.5, -1.0)
    assert content["mesh_orders"][0] == 59.0
    assert "28.31" in capsys.readouterr().out


def test_lateral_motion_adds_22_masses(written):
    content = written(f"modes {TRAIN} system.lateral=true")
    assert np.shape(content["shapes"]) == (67 + 22, 67 + 22)
    expected = [0.0, 28.31, 68.71, 161.92]
    assert_allclose(frequencies(content, 4), expected, rtol=0, atol=0.01)


def test_a_viscous_damper_is_an_option(written):
    content = written(f"modes {TRAIN} system.viscous_damper_node=1")
    expected = [28.56, 70.36, 166.49, 215.97]
    assert_allclose(frequencies(content, 5)[1:], expected, rtol=0, atol=0.005)


@pytest.mark.parametrize(("system", "n"), [("spur_pair", 6), ("two_stage_gearbox", 8)])
def test_other_machines_have_modes_and_figures(written, drawn, system, n):
    content = written(f"modes system={system} --plot modes.png")
    assert content["system"] == system
    assert len(content["natural_frequencies_hz"]) == n
    assert content["n_rigid_modes"] == 1
    campbell, *shapes = drawn[0]
    assert campbell.startswith("Campbell diagram")
    hz = content["natural_frequencies_hz"]
    damping = content["damping_ratio"]
    titles = [f"mode {k}: {hz[k]:.2f} Hz, damping {damping[k]:.3f}" for k in range(n)]
    assert shapes == titles[1:7]
    assert drawn[0][shapes[-1]].get_xlabel()


def test_modes_of_a_pair_name_the_motions_of_its_gears(gensig):
    head, _, *modes = gensig("modes experiment=realistic")[0].splitlines()
    assert "4 inertias, 4 lateral motions of gears" in head
    assert modes[0].endswith("turns freely")
    assert any("% wheel x" in line for line in modes)
    assert "pinion rotation" in modes[-1]
    assert modes[-1].endswith("of the strain in a mesh")


def table(name):
    file = resources.files("gensig.configs").joinpath(f"tables/{name}.csv")
    return file.read_text(encoding="utf-8")


def test_your_own_tables_are_read_by_their_path(written, tmp_path):
    (tmp_path / "mine.csv").write_text(table("engine_shafting"), encoding="utf-8")
    (tmp_path / "my gears.csv").write_text(table("engine_gears"), encoding="utf-8")
    tables = "system.shafting_csv=mine.csv \"system.gears_csv='my gears.csv'\""
    own = written(f"modes system=shaft_line {tables}")
    train = written(f"modes {TRAIN}")
    assert own["natural_frequencies_hz"] == train["natural_frequencies_hz"]


def test_forced_response_writes_the_response_of_every_node(written, capsys):
    content = written(f"{ENGINE} --nodes 14 45")
    printed = capsys.readouterr().out
    own = response_of(option()).fluctuation() / RPM
    assert_allclose(content["speed_fluctuation_rpm"], own, rtol=1e-5)
    assert content["torque_nm"] == 12680
    assert_allclose(content["mean_speed_rpm"][44], 844.0)
    assert np.shape(content["angle_deg"]) == (2, len(content["orders"]))
    assert content["orders"][:3] == [0.5, 1.0, 1.5]
    seen = content["toothed_wheel_fluctuation_rpm"]
    assert own[13] < seen["flywheel"] < 1.3 * own[13]  # teeth out of place add to it
    # A mean over one spacing loses what 120 teeth cannot hold.
    assert 0.5 * own[44] < seen["pump_end"] < 1.1 * own[44]
    drive = content["meshes"].index("21/45")
    assert content["least_tooth_force_n"][drive] < 0.0
    assert "Flywheel" in printed
    assert "would part" in printed


def test_a_run_of_speeds_and_a_disturbance_are_written_and_drawn(written, drawn):
    content = written(
        f"{ENGINE} excitation.dynamometer.disturbance_share=0.05 --nodes 14 "
        "--run 900 1000 100 --speed 1000 --torque 4000 --plot response.png"
    )
    assert content["run_speeds_rpm"] == pytest.approx([900, 1000])
    assert np.shape(content["run_speed_fluctuation_rpm"]) == (1, 2)
    assert np.shape(content["run_angle_deg"])[:2] == (1, 2)
    assert content["disturbance_frequency_hz"] == 5.0
    assert content["disturbance_angle_deg"][0] > 0.0
    assert (content["speed_rpm"], content["torque_nm"]) == (pytest.approx(1000), 4000)
    panels = drawn[0]
    cylinder = panels["One cylinder"]
    assert labels(cylinder) == ["gas", "reciprocating mass"]
    assert cylinder.get_xlim() == (0, 720)
    (run,) = [panels[title] for title in panels if title.startswith("Run of speeds")]
    assert run.get_ylabel() == "speed of the crank, r/min"
    assert [text.get_text() for text in run.texts] == ["0.5", "1", "2.5", "5", "10"]


def test_loads_root_stress_and_a_sweep_in_time_are_written_and_drawn(
    written, drawn, capsys
):
    content = written(
        f"{ENGINE} {DAMPERS} --nodes 14 --time 0.6 --mesh 45 21 "
        "--sweep 1500 1750 0.8 --plot found.png"
    )
    printed = capsys.readouterr().out
    drive = content["meshes"].index("21/45")
    # A cycle has no more than the whole run, and rattling more than the linear line.
    greatest = np.array(content["time_typical_greatest_tooth_force_n"])
    assert np.all(greatest <= content["time_greatest_tooth_force_n"])
    assert greatest[drive] > content["greatest_tooth_force_n"][drive]
    # Order 1 leads at the flywheel, with the amplitude of the linear line.
    assert content["time_orders"][:3] == [0.5, 1.0, 1.5]
    first = content["time_angle_deg"][0][1]
    assert_allclose(first, content["angle_deg"][0][1], rtol=0.1)
    roots = content["root_stress"]
    assert content["root_stress_mesh"] == "21/45"
    for name in ("linear", "in_time"):
        before, after = roots[f"{name}_without_dampers"], roots[name]
        assert after["iso_root_stress_mpa"] < before["iso_root_stress_mpa"]
        assert after["largest_root_stress_mpa"] < after["iso_root_stress_mpa"]
    force = roots["in_time"]["greatest_tooth_force_n"]
    assert force == pytest.approx(greatest[drive])
    assert "by the dampers" in printed
    assert "reliability: high from 2.00 on, higher from 1.60 on" in printed
    speeds = content["sweep_speeds_rpm"]
    n_speeds, n_orders = len(speeds), len(content["sweep_orders"])
    for way in ("sweep_up", "sweep_down"):
        result = content[way]
        assert np.shape(result["angle_deg"]) == (1, n_speeds, n_orders)
        assert np.shape(result["typical_greatest_tooth_force_n"]) == (8, n_speeds)
        assert np.all(np.array(result["speed_fluctuation_rpm"]) > 0.0)
    assert np.all(np.diff(speeds) > 0.0)
    assert "sweep up and down, 0.8 s each way" in printed
    panels = drawn[0]
    stress = panels["Root stress of the pair that bears most, 21/45"]
    assert labels(stress) == [name.replace("_", " ") for name in roots]
    assert labels(panels["Tooth force of mesh 21/45"]) == ["in time", "linear"]
    starts = ("In time, up, ", "In time, down, ", "Speed fluctuation in a cycle, ")
    assert all(any(title.startswith(start) for title in panels) for start in starts)


def test_the_line_takes_the_dampers_that_tune_damper_writes(
    written, gensig, drawn, capsys
):
    content = written(
        f"tune-damper {TRAIN} excitation=engine_v20 --mesh 21 45 --nodes 45 --viscous "
        "--run 1700 1750 50 --most-inertia 0.02 --plot dampers.png "
        "--out mine/system/damped.yaml"
    )
    assert content["mesh"] == "21/45"
    assert content["run_speeds_rpm"] == pytest.approx([1700, 1750])
    before, after = content["before"], content["after"]
    assert after["worst_force_n"] < before["worst_force_n"]
    (damper,) = content["dampers"]
    assert (damper["node"], damper["stiffness_nm_per_rad"]) == (45, 0.0)
    assert damper["ring_inertia_kg_m2"] <= 0.02
    assert 0.0 < content["root_stress_drop"] < 1.0
    force = drawn[0]["Largest tooth force of a cycle"]
    assert labels(force) == ["before", "after"]
    shown = 1e3 * force.lines[1].get_ydata()
    assert_allclose(shown, after["largest_force_n"], rtol=1e-12)
    assert "safety, paper" in capsys.readouterr().out
    damped = "system=damped --config-dir mine"
    response = written(f"forced-response excitation=engine_v20 {damped}")
    drive = response["meshes"].index("21/45")
    greatest = response["greatest_tooth_force_n"][drive]
    assert_allclose(greatest, after["greatest_force_n"], rtol=1e-6)
    assert response["node_numbers"][-1] == 68
    assert "2 rigid mode(s)" in gensig(f"modes {damped}")[0]
