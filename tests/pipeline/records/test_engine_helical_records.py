"""Records of a helical mesh of an engine's train: a small set of an idler's teeth, and what its labels say."""

import h5py
import numpy as np
import pytest

from gensig.cli import main
from gensig.dataset.folder.layout import PLAN
from gensig.dataset.plan import PlanRows
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_record

SMALL = (
    "experiment=engine_broken_tooth", "system.record_mesh=[3,66]", "operating.duration_s=0.05", "plan.n_records=4",
    "plan.n_units=1", "mesh.n_slices=12", "mesh.points_per_pitch=128",
    "plan.classes=[healthy,crack,broken,chipped]",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("engine") / "set"
    assert main(["generate", *SMALL, f"out={out}"]) == 0
    return out


def test_a_set_of_an_idlers_teeth_is_whole_and_comes_again(folder, capsys):
    assert main(["verify", str(folder)]) == 0
    assert main(["reproduce", str(folder), "--records", "1"]) == 0
    capsys.readouterr()
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        assert {value.decode() for value in file["status"][:]} == {"ok"}
        assert np.all(file["integration_error"][:] < 1e-3)
        names = [value.decode() for value in file["label_name"][:]]
        assert sorted(names) == ["broken", "chipped", "crack", "healthy"]
        for name, gear, tooth in zip(
            names, file["fault_gear"][:], file["fault_tooth"][:], strict=True
        ):
            assert (gear.decode(), 0 <= tooth < 68) == (
                ("", False) if name == "healthy" else ("wheel", True)
            )
        # the crank gear drives: the shaft told is the crank's, its teeth 59
        np.testing.assert_allclose(
            file["speed_set_rpm"][:], file["params/operating.speed_rpm"][:]
        )
        np.testing.assert_allclose(
            file["mesh_frequency_hz"][:], 59 * file["speed_rpm"][:] / 60
        )
        signals = file["acceleration"][:]
        assert np.isfinite(signals).all()
        assert np.all(signals.std(axis=-1) > 0.0)


def test_a_record_depends_on_its_row_alone(folder):
    row = next(
        row
        for row in PlanRows(folder / PLAN).records(0, 4)
        if row["label_name"] == "broken"
    )
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        stored = file["acceleration"][int(row["row"])]
    again = simulate_record(read_request([*SMALL]).config, row).signals["acceleration"]
    np.testing.assert_array_equal(again, stored)
