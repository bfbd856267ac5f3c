"""Mesh state and detectability of a data set: stored, read back, no effect on signals."""

from pathlib import Path

import h5py
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


LINE = (
    "experiment=two_stage",
    "executor.n_workers=1",
    "plan.n_records=4",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
    "plan.n_repeats=1",
    "plan.classes=[healthy,missing_tooth]",
    "plan.fault_gear=[output_gear]",
    "operating.duration_s=0.2",
    "dataset.store_mesh_state=true",
)
SECOND = "idler_gear_2_output_gear"


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("backend", ["nystroem", "newmark"])
def test_a_line_has_the_loads_of_every_mesh(tmp_path: Path, backend: str) -> None:
    """A tooth missing from the output gear is engaged in the second mesh alone."""
    out = tmp_path / "set"
    run("generate", "--quiet", *LINE, f"solver.backend={backend}", f"out={out}")
    run("verify", out)
    run("export", out, "--to", "hdf5", "--out", tmp_path / "out.h5")
    with gensig.open_dataset(out) as data, h5py.File(tmp_path / "out.h5") as exported:
        names = data.column("label_name")
        for k in range(data.n_records):
            for name, shape in TRACES.items():
                trace = data.trace(k, f"{SECOND}_{name}")
                assert trace.shape == (*shape, data.n_samples)
                np.testing.assert_array_equal(exported[f"{SECOND}_{name}"][k], trace)
            engaged = data.trace(k, f"{SECOND}_fault_engaged")
            assert engaged.any() == (names[k] == "missing_tooth")
            assert not data.trace(k, "fault_engaged").any()
        force = data.trace(0, f"{SECOND}_mesh_force").mean()
        assert 1.9 < force / data.trace(0, "mesh_force").mean() < 2.1
        assert SECOND not in "".join(data.column_names)
    with h5py.File(tmp_path / "out.h5") as exported:
        assert exported[f"{SECOND}_mesh_force"].attrs["unit"] == b"N"


@pytest.mark.parametrize("kind", ["npz", "parquet", "hdf5"])
def test_exports_hold_it(stored: Path, tmp_path: Path, kind: str) -> None:
    run("export", stored, "--to", kind, "--out", tmp_path / "out")
