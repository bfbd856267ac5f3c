"""Mesh state and detectability of a data set: asked for, stored, read back, and the same as without
them."""

from pathlib import Path

import numpy as np
import pytest
from small_sets import make

import gensig
from gensig.cli import main
from gensig.mesh.pair_table import N_PAIRS

TRACES = {
    "mesh_pinion_tooth": N_PAIRS, "mesh_wheel_tooth": N_PAIRS, "mesh_load_share": N_PAIRS, "mesh_force": None,
    "contact_lost": None, "fault_engaged": None,
}  # fmt: skip


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    return make(tmp_path_factory.mktemp("plain") / "set")


@pytest.fixture(scope="module")
def told(tmp_path_factory) -> Path:
    return make(
        tmp_path_factory.mktemp("told") / "set",
        "dataset.store_mesh_state=true",
        "dataset.store_detectability=true",
    )


def test_signals_keep_their_bits(plain: Path, told: Path) -> None:
    with gensig.open_dataset(plain) as a, gensig.open_dataset(told) as b:
        assert all(
            a.signals(k).tobytes() == b.signals(k).tobytes() for k in range(a.n_records)
        )
        assert not set(TRACES) & set(a.signal_names)
        assert np.isnan(a.column("detectability")).all()


def test_the_mesh_state_is_there(told: Path) -> None:
    with gensig.open_dataset(told) as data:
        for k in range(data.n_records):
            traces = {name: data.trace(k, name) for name in TRACES}
            for name, n_pairs in TRACES.items():
                assert traces[name].shape == (
                    (data.n_samples,) if n_pairs is None else (n_pairs, data.n_samples)
                )
            assert (
                data.trace(k, "mesh_load_share", 10, 20).tobytes()
                == traces["mesh_load_share"][:, 10:20].tobytes()
            )
            np.testing.assert_allclose(
                traces["mesh_load_share"].sum(axis=0), 1.0, rtol=0, atol=1e-6
            )
            if data.column("label_name")[k] == "healthy":
                assert not traces["fault_engaged"].any()


def test_faults_can_be_told_and_sound_gears_cannot(told: Path) -> None:
    with gensig.open_dataset(told) as data:
        names, found = data.column("label_name"), data.column("detectability")
    assert (found[names == "healthy"] == 0.0).all()
    assert (found[names == "crack"] > 0.0).all()


def test_the_set_is_whole_and_is_made_again(
    told: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(told)]) == 0
    assert main(["reproduce", str(told), "--records", "3"]) == 0
    capsys.readouterr()


@pytest.mark.parametrize("kind", ["npz", "parquet", "hdf5"])
def test_exports_hold_it(told: Path, tmp_path: Path, kind: str) -> None:
    pytest.importorskip("pyarrow")
    assert (
        main(["export", str(told), "--to", kind, "--out", str(tmp_path / "out")]) == 0
    )


def test_a_switch_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(
            ["generate", "dataset.store_mesh_state=perhaps", f"out={tmp_path / 'set'}"]
        )
        != 0
    )
    assert (
        "dataset.store_mesh_state = 'perhaps' must be true or false"
        in capsys.readouterr().err
    )
