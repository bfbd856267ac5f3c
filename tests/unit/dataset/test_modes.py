"""Stored files of a data set have the mode that the umask gives, whoever writes them."""

import os
import stat

import pytest
from dataset_samples import build, make_plan

from gensig.dataset.exports.export import export

FORMATS = ("hdf5", "parquet", "npz", "wav")


def other_modes(folder, umask):
    """Files and folders below a folder whose mode is not that of the umask."""
    wrong = []
    for path in folder.rglob("*"):
        mode = stat.S_IMODE(path.stat().st_mode)
        whole = 0o777 if path.is_dir() else 0o666
        if mode != whole & ~umask:
            wrong.append(f"{path.name} {mode:o}")
    return wrong


@pytest.mark.parametrize("umask", [0o022, 0o027, 0o077])
def test_a_set_and_its_exports_follow_the_umask(tmp_path, umask):
    pytest.importorskip("pyarrow", reason="extra parquet")
    before = os.umask(umask)
    try:
        plan = make_plan(n_records=4, records_per_shard=2, n_units=2, n_classes=2)
        folder = build(tmp_path / "made" / "set", plan)
        for to in FORMATS:
            export(folder, to, tmp_path / "made" / f"as_{to}", one_channel=to == "wav")
    finally:
        os.umask(before)
    assert len(list((tmp_path / "made").rglob("*"))) > 20
    assert other_modes(tmp_path / "made", umask) == []


def test_a_file_of_another_mode_is_seen(tmp_path):
    (tmp_path / "a.bin").touch(0o600)
    (tmp_path / "a.bin").chmod(0o600)
    assert other_modes(tmp_path, 0o022) == ["a.bin 600"]
