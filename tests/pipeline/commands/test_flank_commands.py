"""The verbs on loaded flanks from the command line: what they write, and what they refuse in one line."""

import functools
import json

import numpy as np
import pytest
import yaml

import gensig.commands.gears.modify
from gensig.cli import main
from gensig.systems.flank_optimum import optimise

HELICAL = [
    "system=helical_pair",
    "mesh.n_slices=12",
    "mesh.slice_coupling=independent",
    "mesh.contact=linear",
]


def test_transmission_error_writes_what_it_promises(tmp_path, capsys):
    out, figure = tmp_path / "te.json", tmp_path / "te.png"
    assert (
        main(
            ["transmission-error", *HELICAL, "--json", str(out), "--plot", str(figure)]
        )
        == 0
    )
    content = json.loads(out.read_text())
    assert {
        "transverse_contact_ratio", "overlap_ratio", "total_contact_ratio", "transmission_error_um", "peak_to_peak_um",
        "mean_um", "max_line_load_n_per_mm", "max_contact_pressure_mpa",
    } <= set(content)  # fmt: skip
    assert content["total_contact_ratio"] == pytest.approx(3.325, abs=1e-3)
    assert np.ptp(content["transmission_error_um"]) == pytest.approx(
        content["peak_to_peak_um"]
    )
    assert content["roll_angle_deg"][-1] < 360 / 61
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert f"{content['mean_um']:.4f} um" in capsys.readouterr().out


def test_a_spur_pair_has_one_too(tmp_path):
    assert main(["transmission-error", "--json", str(tmp_path / "te.json")]) == 0
    content = json.loads((tmp_path / "te.json").read_text())
    assert content["overlap_ratio"] == 0
    assert content["peak_to_peak_um"] > 0.5


def test_stiffness_of_a_helical_pair(tmp_path, capsys):
    out, figure = tmp_path / "s.json", tmp_path / "s.svg"
    assert main(["stiffness", *HELICAL, "--json", str(out), "--plot", str(figure)]) == 0
    content = json.loads(out.read_text())
    single, mesh = (
        content["single_pair_stiffness_n_per_m"],
        content["mesh_stiffness_n_per_m"],
    )
    assert max(single) < min(mesh)
    assert (
        f"{content['mesh_stiffness_mean_n_per_m']:.4e} N/m" in capsys.readouterr().out
    )
    assert figure.stat().st_size > 1000


def test_a_fault_is_told_over_the_periods_that_see_it(tmp_path, capsys):
    words = [
        "system=helical_pair",
        "mesh.n_slices=12",
        "fault=crack",
        "fault.crack_depth_mm=1",
    ]
    out, figure = tmp_path / "te.json", tmp_path / "te.png"
    assert (
        main(["transmission-error", *words, "--json", str(out), "--plot", str(figure)])
        == 0
    )
    content = json.loads(out.read_text())
    assert content["mesh_periods"] == 8
    assert (
        len(content["transmission_error_um"]) == len(content["fault_adds_um"]) == 8 * 64
    )
    assert max(content["fault_adds_um"]) > 0.5
    assert "the fault adds             0 .. 0." in capsys.readouterr().out
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert main(["stiffness", *words, "--json", str(out), "--plot", str(figure)]) == 0
    content = json.loads(out.read_text())
    single, faulty = (
        content["single_pair_stiffness_n_per_m"],
        content["faulty_pair_stiffness_n_per_m"],
    )
    assert max(faulty) < 0.95 * max(single)
    assert min(content["mesh_stiffness_n_per_m"]) < 0.97 * min(
        content["sound_mesh_stiffness_n_per_m"]
    )
    assert "the mesh loses" in capsys.readouterr().out


def test_a_modification_too_deep_to_close_is_said(capsys):
    deep = [
        "modification.pinion.tip_relief_um=100",
        "modification.pinion.tip_relief_height_mm=1",
    ]
    assert main(["transmission-error", *HELICAL, *deep]) == 0
    assert "% of the field of action carry no load" in capsys.readouterr().err
    assert main(["transmission-error", *HELICAL]) == 0
    assert capsys.readouterr().err == ""


def test_what_modify_flank_writes_other_commands_take(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(
        gensig.commands.gears.modify,
        "optimise",
        functools.partial(optimise, generations=1),
    )
    target, front, figure = (
        tmp_path / "mine" / "modification" / "best.yaml",
        tmp_path / "f.json",
        tmp_path / "f.png",
    )
    target.parent.mkdir(parents=True)
    words = [
        "modify-flank",
        *HELICAL,
        "--points",
        "1",
        "--misalignments",
        "0",
        "4",
        "--seed",
        "3",
    ]
    assert (
        main(
            [*words, "--out", str(target), "--json", str(front), "--plot", str(figure)]
        )
        == 0
    )
    assert "modification=best --config-dir" in capsys.readouterr().out
    chosen = json.loads(front.read_text())["chosen"]
    assert (
        yaml.safe_load(target.read_text())["pinion"] == chosen["modification"]["pinion"]
    )
    out = tmp_path / "te.json"
    both = [
        "modification=best",
        "modification.misalignment_um=4",
        "--config-dir",
        str(tmp_path / "mine"),
    ]
    assert main(["transmission-error", *HELICAL, *both, "--json", str(out)]) == 0
    content = json.loads(out.read_text())
    # the option is rounded to 1 nm; the front holds the worst of both misalignments
    assert content["peak_to_peak_um"] <= chosen["peak_to_peak_um"] + 2e-3
    assert content["max_line_load_n_per_mm"] <= chosen["max_line_load_n_per_mm"] * 1.001
    assert figure.exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["modify-flank", *HELICAL, "fault=crack", "--out", "best.yaml"],
            "a modification is for sound flanks",
        ),
        (
            [
                "transmission-error",
                *HELICAL,
                "fault=crack",
                "fault.crack_depth_mm=1",
                "fault.crack_width_mm=5",
            ],
            "mesh.slice_coupling = 'independent' with a fault over part of the face",
        ),
        (
            ["transmission-error", *HELICAL, "--plot", "te.txt"],
            "the name must end in .png",
        ),
        (["transmission-error", *HELICAL, "operating.torque_nm=0"], "torque"),
        (
            ["transmission-error", *HELICAL, "mesh.n_slices=0"],
            "mesh.n_slices = 0 must lie in 1..1000",
        ),
        (
            ["transmission-error", *HELICAL, "gear.helix_angle_deg=60"],
            "must lie between -45 and 45",
        ),
        (["modify-flank", *HELICAL, "--out", "best.txt"], "give a file NAME.yaml"),
        (
            ["modify-flank", *HELICAL, "--out", "best.yaml", "--points", "0"],
            "--points 0",
        ),
        (
            ["modify-flank", *HELICAL, "--out", "best.yaml", "--torques", "-1"],
            "must be positive",
        ),
        (
            ["generate", *HELICAL, "mesh.slices_in_phase=true", "out=never"],
            "slices_in_phase = true is for comparing",
        ),
    ],
)
def test_mistakes_are_one_line(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
