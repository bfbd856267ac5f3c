"""Records of shipped pairs have the mesh at its frequency; lines turn by their teeth."""

import warnings

import numpy as np
import pytest
from record_sets import records

from diagnose.baselines.features import indicators
from gensig.driveline.drive_line import read_drive_line
from gensig.options.groups import options
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.systems.registry import PairParts

INTERRUPTED = "harbin_38_55"  # contact ratio below 1, as its paper prints it
DAMPING = (
    "quality.support_damping_ratio_low=0.03",
    "quality.support_damping_ratio_high=0.03",
)
LINES = {
    "two_stage_gearbox": (32, 96, 48, 80),
    "uconn_two_stage": (32, 80, 48, 64),
    "phm09_helical_two_stage": (16, 48, 24, 40),
}


def words_for(name):
    """The gears with the system that takes them."""
    words = [f"gear={name}"]
    gear = read_request(words).config["gear"]
    if gear["pinion"]["support"]["stiffness_x_n_per_m"] is None:
        words += ["system.supports=bearings", *DAMPING]
    if gear["helix_angle_deg"]:
        words += ["system=helical_pair", "mesh.n_slices=8"]
    return words


def strongest_comb(signal, rate, expected):
    """Frequency within 4 % at which a comb of five harmonics is strongest, Hz."""
    windowed = np.hanning(len(signal)) * signal
    time = np.arange(len(signal)) / rate
    frequencies = expected * np.linspace(0.96, 1.04, 161)
    harmonics = np.arange(1, 6)[:, None]
    harmonics = harmonics[harmonics[:, 0] * frequencies[-1] < 0.45 * rate]

    def strength(frequency):
        waves = np.exp(-2j * np.pi * harmonics * frequency * time)
        return np.sum(np.abs(waves @ windowed) ** 2)

    return max(frequencies, key=strength)


@pytest.mark.parametrize(
    "name", [name for name in options("gear") if name != INTERRUPTED]
)
def test_the_mesh_of_shipped_gears_stands_out(name):
    short = ("plan.n_records=2", "plan.n_units=1", "operating.duration_s=0.25")
    config, _, made = records(*words_for(name), *short, "sensing.snr_db=30")
    gear = config["gear"]
    n_teeth = {side: gear[side]["n_teeth"] for side in ("pinion", "wheel")}
    speed = gear["rated_speed_rpm"] / 60.0
    turns = {"pinion": speed, "wheel": speed * n_teeth["pinion"] / n_teeth["wheel"]}
    for record in made:
        signal = record.signals["acceleration"]
        assert np.all(np.isfinite(indicators(signal, 51200.0, turns, n_teeth)))
        # around a missing tooth the sidebands may be louder than the mesh
        if record.values["label_name"] == "healthy":
            expected = n_teeth["pinion"] * speed
            result = strongest_comb(signal[1], 51200.0, expected)
            assert result == pytest.approx(expected, rel=2e-3)


def test_the_test_pair_has_the_centre_distance_and_tips_of_its_rig():
    pair = PairParts(read_request(["gear=fzg_c_16_24"]).config).pair
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


@pytest.mark.parametrize("name", LINES)
def test_supports_of_two_stage_gearboxes_are_for_the_rated_load(name):
    """Each gear for the force of its own teeth; no mesh is far above its supports."""
    words = [f"system={name}", "sensing=geared_line_bearings"]
    machine = read_machine(read_request(words).config)
    drive = machine.engine.drive
    for mesh, force in zip(drive.line.meshes, machine.mesh_forces, strict=True):
        ends = (
            drive.support_forces[mesh.driving],
            drive.support_forces[mesh.driven],
        )
        assert ends == pytest.approx((force, force), rel=1e-3)
    stiffness = {
        force: drive.line.gears[number].support.stiffness_y
        for number, force in enumerate(drive.support_forces)
    }
    least, greatest = min(stiffness), max(stiffness)
    # shaft and bearing in series: less than by the third root of the force, which balls give
    assert 1.0 < stiffness[greatest] / stiffness[least] < (greatest / least) ** (1 / 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        machine.check()
