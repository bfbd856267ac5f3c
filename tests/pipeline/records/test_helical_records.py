"""Data sets of helical pairs: the same engine, channels along the shafts too, faults over part of
the face."""

from pathlib import Path

import numpy as np
import pytest
from record_sets import run
from small_sets import make

import gensig
from gensig.dynamics._layout import MOST_PAIRS
from gensig.plan.request import read_request
from gensig.systems.base import simulate_together
from gensig.systems.registry import read_system
from gensig.systems.run import Run

CHANNELS = ["pinion_y", "pinion_z", "wheel_y", "wheel_z"]
CLASSES = ["healthy", "crack", "pitting", "chipped", "missing_tooth"]
SMALL = (
    "experiment=helical",
    "plan.n_records=10",
    "plan.n_units=2",
    "plan.n_gearboxes=2",
    "operating.duration_s=0.05",
    "mesh.n_slices=16",
    "dataset.store_mesh_state=true",
    f"sensing.channels=[{','.join(CHANNELS)}]",
    f"plan.classes=[{','.join(CLASSES)}]",
    "sensing.snr_db=30",
)


@pytest.fixture(scope="module")
def helical(tmp_path_factory) -> Path:
    return make(tmp_path_factory.mktemp("helical") / "set", *SMALL)


def test_a_set_is_whole_and_names_its_channels_and_its_helix(helical: Path) -> None:
    run("verify", helical)
    run("reproduce", helical, "--records", 2)
    with gensig.open_dataset(helical) as data:
        assert list(data.channel_names) == CHANNELS
        assert set(data.column("label_name")) == set(CLASSES)
        assert set(data.column("status")) == {"ok"}
        assert set(data.column("integration_check")) == {"error"}
        assert data.column("integration_error").max() <= 1e-3
        for k in range(data.n_records):
            assert (data.signals(k).std(axis=1) > 0.0).all()
        ratio = read_system(read_request(list(SMALL)).config).pair.overlap_ratio
        assert data.attributes["overlap_ratio"] == ratio
    card = (helical / "README.md").read_text().replace("\\", "")
    shown = {
        "helix_angle_deg": 18.0,
        "face_width_wheel_mm": 14.0,
        "overlap_ratio": round(ratio, 4),
    }
    for name, value in shown.items():
        assert f"| {name} | {value} |" in card


def test_loads_of_all_pairs_are_told(helical: Path) -> None:
    with gensig.open_dataset(helical) as data:
        for k in range(data.n_records):
            share = data.trace(k, "mesh_load_share")
            assert share.shape == (MOST_PAIRS, data.n_samples)
            np.testing.assert_allclose(share.sum(axis=0), 1.0, atol=1e-6)
            carrying = (data.trace(k, "mesh_pinion_tooth") >= 0).sum(axis=0)
            missing = data.column("label_name")[k] == "missing_tooth"
            assert 2 - missing <= carrying.min() <= carrying.max() <= 5


def test_without_a_helix_it_moves_like_the_spur_pair() -> None:
    words = (
        "operating.duration_s=0.1",
        "mesh.contact=linear",
        "quality.iso1328_grade=null",
        "solver.max_error=null",
        "solver.oversampling=20",
    )
    sliced = ("system=helical_pair", "gear=xiamen_23_84", "mesh.n_slices=8")
    runs = [
        Run(system=read_system(read_request([*words, *more]).config), faults=())
        for more in ((), sliced)
    ]
    one, other = (record.acceleration for record in simulate_together(runs))
    assert np.all((one - other).std(axis=1) < 0.01 * one.std(axis=1))
