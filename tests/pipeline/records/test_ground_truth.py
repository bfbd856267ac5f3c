"""Mesh state and detectability of a data set: stored, read back, no effect on signals."""

from pathlib import Path

import numpy as np
import pytest
from record_sets import run
from small_sets import make

import gensig
from gensig.mesh.pair_table import N_PAIRS

TRACES = {
    "mesh_pinion_tooth": (N_PAIRS,),
    "mesh_wheel_tooth": (N_PAIRS,),
    "mesh_load_share": (N_PAIRS,),
    "mesh_force": (),
    "contact_lost": (),
    "fault_engaged": (),
}


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    return make(tmp_path_factory.mktemp("plain") / "set")


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> Path:
    return make(
        tmp_path_factory.mktemp("stored") / "set",
        "dataset.store_mesh_state=true",
        "dataset.store_detectability=true",
    )


def test_signals_keep_their_bits(plain: Path, stored: Path) -> None:
    with gensig.open_dataset(plain) as a, gensig.open_dataset(stored) as b:
        for k in range(a.n_records):
            np.testing.assert_array_equal(a.signals(k), b.signals(k))
        assert not set(TRACES) & set(a.signal_names)
        assert np.isnan(a.column("detectability")).all()


def test_the_mesh_state_is_there(stored: Path) -> None:
    with gensig.open_dataset(stored) as data:
        for k in range(data.n_records):
            traces = {name: data.trace(k, name) for name in TRACES}
            for name, shape in TRACES.items():
                assert traces[name].shape == (*shape, data.n_samples)
            share = traces["mesh_load_share"]
            part = data.trace(k, "mesh_load_share", 10, 20)
            np.testing.assert_array_equal(part, share[:, 10:20])
            np.testing.assert_allclose(share.sum(axis=0), 1.0, atol=1e-6)
            if data.column("label_name")[k] == "healthy":
                assert not traces["fault_engaged"].any()


def test_faults_can_be_stored_and_sound_gears_cannot(stored: Path) -> None:
    with gensig.open_dataset(stored) as data:
        names, result = data.column("label_name"), data.column("detectability")
    assert (result[names == "healthy"] == 0.0).all()
    assert (result[names == "crack"] > 0.0).all()


@pytest.mark.parametrize("kind", ["npz", "parquet", "hdf5"])
def test_exports_hold_it(stored: Path, tmp_path: Path, kind: str) -> None:
    run("export", stored, "--to", kind, "--out", tmp_path / "out")
