"""Verbs on one gear pair: stiffness, hot gears, transmission error, root stress."""

import functools
import re

import numpy as np
import pytest
import yaml
from figure_labels import labels
from numpy.testing import assert_allclose

import gensig.commands.gears.modify
from gensig.systems.flank_optimum import optimise

PAPER = "mesh.law=paper mesh.pair_coupling=sum mesh.contact=linear"
SLICED = "system=helical_pair mesh.n_slices=8"
FAST = f"{SLICED} mesh.slice_coupling=independent mesh.contact=linear"
CRACKED = f"{SLICED} fault=crack fault.crack_depth_mm=1"
HOT = f"gear=chongqing_40_162 heat=chongqing_rated {FAST}"


def test_stiffness_json_has_the_promised_keys(written, drawn):
    words = f"fault=crack fault.tooth=3 {PAPER}"
    content = written(f"stiffness {words} --plot k.png")
    assert content["transverse_contact_ratio"] == pytest.approx(1.71178, abs=1e-5)
    assert content["base_pitch_mm"] == pytest.approx(5.90426, abs=1e-5)
    end = content["contact_position"][-1]
    assert end == pytest.approx(content["transverse_contact_ratio"], rel=1e-12)
    sound = np.array(content["single_pair_stiffness_n_per_m"])
    faulty = np.array(content["faulty_pair_stiffness_n_per_m"])
    assert np.all(faulty < sound)
    terms = [
        values
        for gear in content["compliance_m_per_n"].values()
        for values in gear.values()
    ]
    assert len(terms) == 12
    assert_allclose(1.0 / np.sum(terms, axis=0), faulty, rtol=1e-4, atol=0.0)
    roll, mesh = content["roll_angle_deg"], content["mesh_stiffness_n_per_m"]
    assert 0.0 < roll[0] < roll[-1] < 360.0
    mean = content["mesh_stiffness_mean_n_per_m"]
    assert mean == pytest.approx(np.mean(mesh), rel=1e-12)
    panels = drawn[0]
    assert labels(panels["One pair carrying the whole load"]) == [
        "healthy pair",
        "crack pair",
    ]
    assert labels(panels["Mesh stiffness over one revolution"]) == [
        "healthy",
        "with crack",
        "its tooth in contact",
    ]
    assert panels["Compliance terms"].get_yscale() == "log"
    assert "Load sharing at static equilibrium" in panels


def test_stiffness_of_a_wheel_fault_turns_the_wheel(written):
    fault = "fault=missing_tooth fault.gear=wheel fault.tooth=80"
    content = written(f"stiffness {fault} {PAPER}")
    gone = np.array(content["mesh_stiffness_n_per_m"]) == 0.0
    angle = np.array(content["roll_angle_deg"])[gone]
    assert 80 * 360 / 84 < angle.min() < angle.max() < 82 * 360 / 84


def test_contact_ratio_below_one_is_a_warning_of_stiffness(gensig):
    assert "below 1" in gensig("stiffness gear.addendum_coefficient=0.5")[1]


def test_own_config_dir_adds_options(gensig, tmp_path):
    (tmp_path / "fault").mkdir()
    crack = "kind: crack\ngear: wheel\ntooth: 1\ncrack_depth_mm: 2\ncrack_angle_deg: 60"
    option = f"{crack}\ncrack_start: gamma_mid\nvary: {{}}\n"
    (tmp_path / "fault" / "deep.yaml").write_text(option)
    said, _ = gensig("stiffness fault=deep --config-dir .")
    assert "faulty pair loses" in said
    result = re.search(
        r"single pair, highest +(\S+) N/m healthy, (\S+) N/m faulty", said
    )
    assert result is not None
    assert 0.5 < float(result[2]) / float(result[1]) < 1.0


@pytest.mark.parametrize(
    ("n_slices", "told"),
    [
        (8, r", within about \d+% with 8 slices; mesh.n_slices=32 is nearer"),
        (1, ", error unknown with 1 slice"),
    ],
)
def test_a_pressure_whose_slices_are_too_wide_says_so(gensig, n_slices, told):
    said, _ = gensig(f"transmission-error system=helical_pair mesh.n_slices={n_slices}")
    assert re.search(f"largest contact pressure .* MPa{told}\n", said)


def test_transmission_error_writes_what_it_promises(written, drawn, capsys):
    content = written(f"transmission-error {FAST} --plot te.png")
    printed = capsys.readouterr()
    assert content["total_contact_ratio"] == pytest.approx(3.325, abs=1e-3)
    ripple = np.ptp(content["transmission_error_um"])
    assert content["peak_to_peak_um"] == pytest.approx(ripple)
    assert content["roll_angle_deg"][-1] < 360 / 61
    assert content["max_line_load_n_per_mm"] == np.max(content["line_load_n_per_mm"])
    assert f"{content['mean_um']:.4f} um" in printed.out
    assert f"{content['max_contact_pressure_mpa']:.1f} MPa\n" in printed.out
    assert content["max_contact_pressure_error"] < 0.01
    assert printed.err == ""
    error, orders, load, sharing, scale = drawn[0].values()
    assert f"{ripple:.3g} um from peak to peak" in error.get_title()
    heights = [bar.get_height() for bar in orders.patches]
    assert_allclose(heights, content["harmonics_um"], rtol=1e-12)
    assert "ends of the path of contact" in load.get_title()
    assert labels(sharing) == ["one pair", "pair -1", "pair +1"]
    assert scale.get_ylabel() == "N/mm"


def test_stiffness_of_a_helical_pair(written, drawn, capsys):
    content = written(f"stiffness {FAST} --plot s.svg")
    single = max(content["single_pair_stiffness_n_per_m"])
    assert single < min(content["mesh_stiffness_n_per_m"])
    mean = f"{content['mesh_stiffness_mean_n_per_m']:.4e} N/m"
    assert mean in capsys.readouterr().out
    assert list(drawn[0]) == ["One pair, slices on the path", "Mesh"]


def test_a_fault_is_shown_over_the_periods_that_see_it(written, drawn, capsys):
    content = written(f"transmission-error {CRACKED} --plot te.png")
    assert content["mesh_periods"] == 8
    n_phases = len(content["transmission_error_um"])
    assert n_phases == len(content["fault_adds_um"]) == 8 * 64
    assert max(content["fault_adds_um"]) > 0.5
    assert "the fault adds             0 .. 0." in capsys.readouterr().out
    assert {"pair of faulty teeth", "healthy pairs"} <= {
        *labels(drawn[0]["Load sharing"])
    }
    assert "Load over the faulty flanks" in drawn[0]
    content = written(f"stiffness {CRACKED} --plot s.png")
    single = max(content["single_pair_stiffness_n_per_m"])
    assert max(content["faulty_pair_stiffness_n_per_m"]) < 0.95 * single
    sound = min(content["sound_mesh_stiffness_n_per_m"])
    assert min(content["mesh_stiffness_n_per_m"]) < 0.97 * sound
    assert "the mesh loses" in capsys.readouterr().out
    assert labels(drawn[1]["Mesh"]) == ["healthy", "faulty"]


def test_a_modification_too_deep_to_close_is_a_warning(gensig):
    relief = "modification.pinion.tip_relief"
    deep = f"{relief}_um=100 {relief}_height_mm=1"
    _, warned = gensig(f"transmission-error {FAST} {deep}")
    assert "% of the field of action carry no load" in warned


def test_other_commands_take_the_option_of_modify_flank(
    written, drawn, tmp_path, capsys, monkeypatch
):
    quick = functools.partial(optimise, generations=1)
    monkeypatch.setattr(gensig.commands.gears.modify, "optimise", quick)
    target = tmp_path / "mine" / "modification" / "best.yaml"
    target.parent.mkdir(parents=True)
    result = written(
        f"modify-flank {FAST} --points 1 --misalignments 0 4 --seed 3 --plot f.png --out",
        target,
    )
    assert "modification=best --config-dir" in capsys.readouterr().out
    chosen = result["chosen"]
    pinion = chosen["modification"]["pinion"]
    assert yaml.safe_load(target.read_text())["pinion"] == pinion
    content = written(
        f"transmission-error {FAST} modification=best modification.misalignment_um=4 "
        "--config-dir mine"
    )
    # The option is rounded to 1 nm. The front holds the worst of both misalignments.
    assert content["peak_to_peak_um"] <= chosen["peak_to_peak_um"] + 2e-3
    most = chosen["max_line_load_n_per_mm"]
    assert content["max_line_load_n_per_mm"] <= most * 1.001
    front = drawn[0]["Worst of all cases"]
    assert labels(front) == ["front", "before", "chosen"]
    points = [line.get_xdata()[0] for line in front.lines]
    ripples = [result[name]["peak_to_peak_um"] for name in ("before", "chosen")]
    assert points == [chosen["peak_to_peak_um"], *ripples]


def test_stiffness_separates_the_effects_of_heat(written, drawn, capsys):
    content = written(f"stiffness {HOT} --plot s.png")
    text, heat = capsys.readouterr().out, content["heat"]
    variants, bulk = heat["variants"], heat["bulk"]
    assert list(variants) == ["cold", "true", "contact_ratio", "apparent", "softened"]
    key = "mesh_stiffness_mean_n_per_m"
    mean = {name: variant[key] for name, variant in variants.items()}
    assert mean["softened"] < mean["cold"] < mean["contact_ratio"] < mean["apparent"]
    assert f"{mean['softened']:.4e} N/m" in text
    heats = [gear["heat_w"] for gear in bulk.values()]
    assert heat["friction_heat_w"] == pytest.approx(sum(heats), rel=1e-12)
    names = ("true stiffness", "with contact-ratio change", "apparent", "with E(T)")
    assert all(name in text for name in (*names, "flash temperature"))
    # The curves outside of "heat" are those of the pair with all effects.
    ratio = variants["contact_ratio"]["transverse_contact_ratio"]
    assert content["transverse_contact_ratio"] == ratio
    panels = drawn[0]
    curves = labels(panels["One pair, slices on the path"])
    assert curves[:3] == ["cold", "true stiffness", "with contact-ratio change"]
    flash = panels["Flash temperature under the slices' own loads"].lines[0]
    assert_allclose(flash.get_ydata(), heat["flash_temperature_k"])


def test_the_papers_hot_teeth_stand_beside_gensigs(written, drawn, capsys):
    content = written(f"stiffness {HOT} mesh.heat_law=paper --plot s.png")
    text, variants = capsys.readouterr().out, content["heat"]["variants"]
    assert list(variants)[:5] == [
        "cold",
        "true",
        "contact_ratio",
        "apparent",
        "softened",
    ]
    key = "mesh_stiffness_mean_n_per_m"
    mean = {name: variant[key] for name, variant in variants.items()}
    assert mean["paper_cold"] == pytest.approx(mean["cold"], rel=1e-12)
    assert 1e-5 < 1.0 - mean["paper"] / mean["paper_cold"] < 1e-3
    sums = mean["paper_components"], mean["paper_cold_components"]
    assert 1e-5 < 1.0 - sums[0] / sums[1] < 1e-3
    assert sums[1] > mean["cold"]
    assert all(name in text for name in ("the paper's, hot", "eq. (14), hot"))
    curves = labels(drawn[0]["One pair, slices on the path"])
    assert "the paper's, hot" in curves
    assert "eq. (14), hot" not in curves


def test_effects_of_heat_are_switched_one_by_one(written, capsys):
    switched = "heat.growth=false heat.center_distance=false"
    content = written(f"stiffness {HOT} {switched}")
    assert list(content["heat"]["variants"]) == ["cold", "softened"]
    assert "true stiffness" not in capsys.readouterr().out
    assert "heat" not in written(f"stiffness {HOT} heat=none")
    assert "friction heat" not in capsys.readouterr().out


def test_growth_beyond_the_approach_has_no_apparent_stiffness(gensig):
    bodies = ("pinion", "wheel", "housing")
    warm = " ".join(f"heat.{body}_temperature_degc=110" for body in bodies)
    assert "none: teeth grow" in gensig(f"stiffness {HOT} {warm}")[0]


def test_transmission_error_is_that_of_hot_flanks(written, gensig):
    hot = written(f"transmission-error {HOT}")
    cold = written(f"transmission-error {HOT} heat=none")
    assert hot["transverse_contact_ratio"] > cold["transverse_contact_ratio"]
    assert hot["mean_um"] != pytest.approx(cold["mean_um"], rel=1e-3)
    unequal = "heat.pinion_temperature_degc=140 heat.wheel_temperature_degc=60"
    _, warned = gensig(f"transmission-error {HOT} {unequal} heat.center_distance=false")
    assert "unequal growth of hot gears" in warned


def test_root_stress_writes_what_it_promises(written, drawn, capsys):
    words = "gear=engine_pump_drive --stress 349.39"
    content = written(f"root-stress {words} --plot root.png")
    assert content["decisive_gear"] == "wheel"
    assert content["form_factor"] == pytest.approx(1.167, abs=6e-4)
    assert content["tangential_force_n"] == pytest.approx(8393, abs=1)
    assert content["iso_root_stress_mpa"] == pytest.approx(349.39)
    assert content["safety_factor_paper"] == pytest.approx(1.353, rel=0.02)
    assert content["reliability_paper"] == "general"
    assert content["tangential_force_over_mesh_n"] > content["tangential_force_n"]
    stress, roll = content["root_stress_mpa"], content["roll_angle_deg"]
    assert len(stress) == len(roll) == len(content["load_share"]) > 300
    assert content["largest_root_stress_mpa"] == max(stress) < 349.39
    assert roll == sorted(roll)
    gears = content["gears"]
    assert gears["wheel"]["root_stress_mpa"] == stress
    paper = content["safety_factor_paper"]
    assert gears["pinion"]["safety_factor_paper"] > paper
    assert "8393.1 N" in capsys.readouterr().out
    over_mesh = drawn[0]["Root stress of one tooth pair"]
    assert over_mesh.get_ylabel() == "MPa"
    assert_allclose(over_mesh.lines[2].get_ydata(), stress)
    assert any(title.startswith("Tooth of the wheel: Y_F 1.167") for title in drawn[0])


def test_root_stress_of_a_helical_pair_and_an_option_of_your_own(
    written, tmp_path, capsys
):
    words = "root-stress system=helical_pair mesh.n_slices=8"
    before = written(words)
    assert before["overlap_ratio"] > 1.0
    assert before["load_distribution_factor"] < 1.0
    assert before["helix_factor"] < 1.0
    option = tmp_path / "mine" / "strength" / "soft.yaml"
    option.parent.mkdir(parents=True)
    defaults = "defaults:\n  - 18cr2ni4w\n  - _self_\n"
    option.write_text(f"{defaults}bending_limit_mpa: 430\nname: soft\n")
    after = written(f"{words} strength=soft --config-dir mine")
    expected = before["safety_factor_iso"] * 430 / 525.25
    assert after["safety_factor_iso"] == pytest.approx(expected)
    assert "sigma_Flim 430 MPa" in capsys.readouterr().out
