"""Verbs as a user types them: what they write, and one clear line for every mistake."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from gensig.cli import main
from gensig.commands.verbs import VERBS

PAPER = ("mesh.law=paper", "mesh.pair_coupling=sum", "mesh.contact=linear")


def test_stiffness_json_has_the_promised_keys(tmp_path: Path) -> None:
    file, figure = tmp_path / "k.json", tmp_path / "k.png"
    words = [
        "stiffness",
        "fault=crack",
        "fault.tooth=3",
        *PAPER,
        "--json",
        str(file),
        "--plot",
        str(figure),
    ]
    assert main(words) == 0
    content = json.loads(file.read_text())
    assert content["transverse_contact_ratio"] == pytest.approx(1.71178, abs=1e-5)
    assert content["base_pitch_mm"] == pytest.approx(5.90426, abs=1e-5)
    position = np.array(content["contact_position"])
    sound, faulty = (
        np.array(content[f"{kind}_pair_stiffness_n_per_m"])
        for kind in ("single", "faulty")
    )
    assert position[-1] == pytest.approx(content["transverse_contact_ratio"], rel=1e-12)
    assert np.all(faulty < sound)
    terms = [
        values
        for gear in content["compliance_m_per_n"].values()
        for values in gear.values()
    ]
    assert len(terms) == 12
    np.testing.assert_allclose(1.0 / np.sum(terms, axis=0), faulty, rtol=1e-4, atol=0.0)
    roll, mesh = (
        np.array(content["roll_angle_deg"]),
        np.array(content["mesh_stiffness_n_per_m"]),
    )
    assert 0.0 < roll[0] < roll[-1] < 360.0
    assert content["mesh_stiffness_mean_n_per_m"] == pytest.approx(
        mesh.mean(), rel=1e-12
    )
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_stiffness_of_a_wheel_fault_turns_the_wheel(tmp_path: Path) -> None:
    file = tmp_path / "k.json"
    assert (
        main(
            [
                "stiffness",
                "fault=missing_tooth",
                "fault.gear=wheel",
                "fault.tooth=80",
                *PAPER,
                "--json",
                str(file),
            ]
        )
        == 0
    )
    content = json.loads(file.read_text())
    gone = np.array(content["mesh_stiffness_n_per_m"]) == 0.0
    angle = np.array(content["roll_angle_deg"])[gone]
    assert 80 * 360 / 84 < angle.min() < angle.max() < 82 * 360 / 84


def test_contact_ratio_below_one_warns_here_and_is_refused_where_it_must_drive(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stiffness", "gear.addendum_coefficient=0.5"]) == 0
    assert "below 1" in capsys.readouterr().err
    for verb in (["simulate"], ["plan"], ["generate", f"out={tmp_path / 'x'}"]):
        assert main([*verb, "gear.addendum_coefficient=0.5"]) == 2
        assert "below 1" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("suffix", [".h5", ".csv"])
def test_simulate_writes_one_record(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"record{suffix}"
    words = [
        "simulate",
        "fault=missing_tooth",
        "operating.duration_s=0.1",
        "sensing.channels=[pinion_y,wheel_y]",
    ]
    assert main([*words, "--output", str(file), "--plot", str(tmp_path / "r.png")]) == 0
    if suffix == ".h5":
        with h5py.File(file) as shard:
            data, rate = shard["acceleration"][0], shard.attrs["sampling_rate_hz"]
            assert shard["label_name"].asstr()[0] == "missing_tooth"
        assert data.shape == (2, 5120)
        assert rate == 51200.0
        assert main(["inspect", str(file)]) == 0
    else:
        table = np.genfromtxt(file, delimiter=",", names=True)
        assert table.dtype.names == ("time_s", "pinion_y_m_per_s2", "wheel_y_m_per_s2")
        assert len(table) == 5120
    assert (tmp_path / "r.png").stat().st_size > 10_000
    before = file.stat().st_mtime_ns
    assert main([*words, "--output", str(file)]) == 2
    assert (
        "is there already; choose another name, or add --force"
        in capsys.readouterr().err
    )
    assert file.stat().st_mtime_ns == before
    assert main([*words, "--output", str(file), "--force"]) == 0
    assert file.stat().st_mtime_ns > before
    assert not list(tmp_path.glob(".*"))


def test_plan_predicts_without_writing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "plan",
        "experiment=quickstart",
        "operating.duration_s=0.05",
        f"out={tmp_path / 'x'}",
    ]
    assert main(words) == 0
    said, notes = capsys.readouterr()
    assert "records    400" in said
    assert "healthy 100" in said
    assert re.fullmatch(r"making \d+ of 400 records to time them\n", notes)
    assert not (tmp_path / "x").exists()


def test_typed_fault_narrows_the_classes(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            [
                "plan",
                "experiment=quickstart",
                "fault=crack",
                "operating.duration_s=0.02",
            ]
        )
        == 0
    )
    said, notes = capsys.readouterr()
    assert "crack 400" in said
    assert (
        "gensig: note: fault=crack replaces plan.classes [healthy, crack, pitting, missing_tooth]\n"
        in notes
    )


def test_own_config_dir_adds_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fault").mkdir()
    (tmp_path / "fault" / "deep.yaml").write_text(
        "kind: crack\ngear: wheel\ntooth: 1\ncrack_depth_mm: 2\ncrack_angle_deg: 60\ncrack_start: gamma_mid\nvary: {}\n"
    )
    assert main(["stiffness", "fault=deep", "--config-dir", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "faulty pair loses" in said
    found = re.search(r"single pair, highest +(\S+) N/m sound, (\S+) N/m faulty", said)
    assert found is not None
    assert 0.5 < float(found[2]) / float(found[1]) < 1.0


BAD = {
    "unknown key": (["stiffness", "operating.speed_rp=3"], "operating.speed_rpm"),
    "unknown option": (["stiffness", "fault=crak"], "crack"),
    "unknown group": (["stiffness", "gaer=x"], "gear"),
    "unknown verb": (["genrate"], "generate"),
    "unknown flag": (["stiffness", "--jsn", "x"], "--help"),
    "no out": (["generate"], "out=DIR"),
    "no records": (["generate", "plan.n_records=0", "out=@/x"], "plan.n_records"),
    "not a number": (
        ["generate", "operating.torque_nm=much", "out=@/x"],
        "operating.torque_nm",
    ),
    "negative depth": (
        ["generate", "fault=crack", "fault.crack_depth_mm=-1", "out=@/x"],
        "crack_depth_mm",
    ),
    "crack through the tooth": (
        ["stiffness", "fault=crack", "fault.crack_depth_mm=4.2"],
        "root chord",
    ),
    "pit off the flank": (
        ["stiffness", "fault=pitting", "fault.pit_position_mm=9"],
        "pit_position_mm",
    ),
    "pit over the face": (
        ["stiffness", "fault=pitting", "fault.pit_width_mm=21"],
        "20 mm wide",
    ),
    "pit through the tooth": (
        ["stiffness", "fault=pitting", "fault.pit_depth_mm=3"],
        "pit_depth_mm",
    ),
    "tooth not on the gear": (["stiffness", "fault=crack", "fault.tooth=23"], "0..22"),
    "fault key of another fault": (
        ["stiffness", "fault=crack", "fault.pit_width_mm=3"],
        "pit_width_mm",
    ),
    "undercut": (["stiffness", "gear.pinion.n_teeth=12"], "undercut"),
    "bore outside the fit": (
        ["stiffness", "mesh.body=sainsot", "gear.pinion.bore_radius_mm=2"],
        "allow_extrapolation",
    ),
    "rim too thin": (["stiffness", "gear.pinion.bore_radius_mm=18"], "modules thick"),
    "sweep without -m": (["generate", "fault=crack,pitting", "out=@/x"], "-m"),
    "bad distribution": (
        ["plan", "plan.vary={sensing.snr_db:{distribution:uniform,low:3}}"],
        "low, high",
    ),
    "varied text": (
        ["plan", "plan.vary={mesh.law:{distribution:uniform,low:0,high:1}}"],
        "mesh.law",
    ),
    "varied geometry": (
        ["plan", "plan.vary={gear.backlash_um:{distribution:uniform,low:0,high:1}}"],
        "-m",
    ),
    "no data set": (["verify", "@"], "no gensig data set"),
    "no such path": (["inspect", "@/nothing"], "does not exist"),
    "no channel": (["simulate", "sensing.channels=[pinion_z]"], "pinion_y"),
    "helical": (["stiffness", "gear.helix_angle_deg=10"], "helix_angle_deg"),
    "output format": (
        ["simulate", "operating.duration_s=0.01", "--output", "@/x.txt"],
        ".csv",
    ),
    "figure format": (["stiffness", "--plot", "@/x.foo"], ".png"),
    "no folder for a file": (["stiffness", "--json", "@/nowhere/x.json"], "no folder"),
    "no sample": (
        ["generate", "operating.duration_s=1e-6", "out=@/x"],
        "operating.duration_s",
    ),
    "compression": (["generate", "dataset.compression=zip", "out=@/x"], "gzip"),
    "poisson": (["stiffness", "material.poisson_ratio=0.7"], "0.5"),
    "group as value": (["stiffness", "gear.pinion=3"], "gear.pinion"),
    "group deleted": (["stiffness", "~fault"], "fault"),
    "config dir": (["stiffness", "--config-dir", "@/nothing"], "--config-dir"),
    "spoken in Hydra": (["stiffness", "seed=[1"], "override"),
    "workers": (["generate", "executor.n_workers=0", "out=@/x"], "executor.n_workers"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_is_one_line_and_touches_nothing(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words, hint = BAD[name]
    assert main([word.replace("@", str(tmp_path)) for word in words]) == 2
    captured = capsys.readouterr()
    lines = [
        line
        for line in captured.err.splitlines()
        if not line.startswith("gensig: note:")
    ]
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("gensig: ")
    assert hint in lines[0]
    assert list(tmp_path.iterdir()) == []


def test_existing_folder_is_refused_and_untouched(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    precious = tmp_path / "precious.txt"
    precious.write_text("mine")
    assert main(["generate", f"out={tmp_path}"]) == 2
    assert "not empty" in capsys.readouterr().err
    assert precious.read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["precious.txt"]


@pytest.mark.parametrize("verb", [*VERBS, None])
def test_help_has_an_example(
    verb: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--help"] if verb is None else [verb, "--help"]) == 0
    said = capsys.readouterr().out
    assert (f"gensig {verb}" if verb else "commands:") in said
    assert verb is None or "example" in said
