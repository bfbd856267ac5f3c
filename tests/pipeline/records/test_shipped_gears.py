"""Every pair of gears that ships makes records whose mesh is heard where its teeth say; drive lines turn by theirs."""

import h5py
import numpy as np
import pytest

from diagnose.baselines.features import indicators
from gensig.cli import main
from gensig.driveline.drive_line import read_drive_line
from gensig.options.compose import options
from gensig.plan.request import read_request
from gensig.systems.registry import read_pair

INTERRUPTED = "harbin_38_55"  # contact ratio below 1, as its paper prints it
TEETH = {"fzg_c_16_24": (16, 24), "uconn_32_80": (32, 80), "phm09_16_48": (16, 48)}
LINES = {"two_stage_gearbox": (32, 96, 48, 80), "uconn_two_stage": (32, 80, 48, 64),
         "phm09_helical_two_stage": (16, 48, 24, 40)}  # fmt: skip


def words_for(name: str) -> list[str]:
    """The gears with the system that takes them."""
    helix = read_request([f"gear={name}"]).config["gear"]["helix_angle_deg"]
    return [
        f"gear={name}",
        *(["system=helical_pair", "mesh.n_slices=8"] if helix else []),
    ]


def heard_mesh_frequency(signal: np.ndarray, rate: float, expected: float) -> float:
    """Where within 4 % a comb of five harmonics is strongest, Hz."""
    window = np.hanning(len(signal))
    time = np.arange(len(signal)) / rate
    frequencies = expected * np.linspace(0.96, 1.04, 161)
    harmonics = [n for n in range(1, 6) if n * frequencies[-1] < 0.45 * rate]
    comb = [
        sum(
            abs(np.exp(-2j * np.pi * n * f * time) @ (window * signal)) ** 2
            for n in harmonics
        )
        for f in frequencies
    ]
    return float(frequencies[np.argmax(comb)])


@pytest.mark.parametrize(
    "name", [name for name in options("gear") if name != INTERRUPTED]
)
def test_shipped_gears_make_a_data_set_that_sounds_like_them(name, tmp_path, capsys):
    words = words_for(name)
    gear = read_request(words).config["gear"]
    out = tmp_path / "set"
    plan = (
        "plan.n_records=4",
        "plan.n_units=2",
        "plan.classes=[healthy,missing_tooth]",
        "operating.duration_s=0.25",
    )
    assert main(["simulate", *words, "operating.duration_s=0.05"]) == 0
    assert (
        main(
            [
                "generate",
                "--quiet",
                *words,
                *plan,
                "sensing.snr_db=30",
                "executor.n_workers=1",
                f"out={out}",
            ]
        )
        == 0
    )
    assert main(["verify", str(out)]) == 0
    expected = gear["pinion"]["n_teeth"] * gear["rated_speed_rpm"] / 60.0
    turns = {"pinion": gear["rated_speed_rpm"] / 60.0}
    n_teeth = {side: gear[side]["n_teeth"] for side in ("pinion", "wheel")}
    turns["wheel"] = turns["pinion"] * n_teeth["pinion"] / n_teeth["wheel"]
    heard: list[float] = []
    for shard in out.glob("shards/*.h5"):
        with h5py.File(shard) as file:
            for record, label in zip(
                file["acceleration"], file["label_name"].asstr(), strict=True
            ):
                assert np.all(np.isfinite(indicators(record, 51200.0, turns, n_teeth)))
                if (
                    label == "healthy"
                ):  # around a missing tooth the sidebands may be louder than the mesh
                    heard.append(heard_mesh_frequency(record[1], 51200.0, expected))
    assert heard == pytest.approx([expected] * 2, rel=2e-3)


def test_the_pair_without_continuous_drive_is_refused(capsys):
    assert main(["simulate", f"gear={INTERRUPTED}"]) == 2
    assert "transverse contact ratio 0.9187 is below 1" in capsys.readouterr().err


@pytest.mark.parametrize("name", TEETH)
def test_rigs_have_the_teeth_of_their_sources(name):
    pair = read_pair(read_request(words_for(name)).config)
    assert (pair.pinion.n_teeth, pair.wheel.n_teeth) == TEETH[name]


def test_the_test_pair_has_the_centre_distance_and_tips_of_its_rig():
    pair = read_pair(read_request(["gear=fzg_c_16_24"]).config)
    assert pair.center_distance == pytest.approx(91.5e-3, rel=1e-4)
    assert 2e3 * pair.pinion.tip_radius == pytest.approx(82.46, abs=0.02)
    assert 2e3 * pair.wheel.tip_radius == pytest.approx(118.36, abs=0.02)
    assert pair.transverse_contact_ratio == pytest.approx(1.4375, abs=0.005)


@pytest.mark.parametrize("name", LINES)
def test_two_stage_gearboxes_turn_by_their_teeth(name):
    line = read_drive_line(read_request([f"system={name}"]).config)
    first, second, third, fourth = LINES[name]
    speeds = line.modes().shapes[0]
    ratios = np.abs(speeds / speeds[0])
    assert np.min(np.abs(ratios - first / second)) < 1e-6
    assert ratios[-1] == pytest.approx(first / second * third / fourth, rel=1e-6)
