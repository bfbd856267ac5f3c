"""Sample types and compressions: equal signals from all, and invalid scales are found."""

import multiprocessing
import os
import re
import shutil
import sys

import h5py
import numpy as np
import pytest
from dataset_samples import (
    SIGNALS,
    build,
    forge,
    make_plan,
    row_of,
    setting,
    write_shard,
    writer_of,
)
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import gensig.dataset.storage.guard as guard_module
import gensig.dataset.storage.shard as shard_module
from gensig.cli import main
from gensig.dataset.folder.inspection import inspect
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.dataset.schema import SAMPLE_TYPES, SCALES
from gensig.dataset.storage.compression import COMPRESSIONS, compression_of
from gensig.dataset.storage.guard import open_shard
from gensig.dataset.storage.quantization import quantized, read_signal
from gensig.errors import DatasetError
from gensig.text.installation import install

HALF_COUNT = 0.5 * (1 + 1e-9)
FAILED = 12
SCALE = "acceleration_scale"


STORED = {"compression": "blosc2", "sample_type": "int16"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A set of int16 with blosc2, a failed record and signals without noise; read only."""
    out = tmp_path_factory.mktemp("whole") / "set"
    return build(out, make_plan(), failed=FAILED, clean=True, **STORED)


def expected(index):
    return row_of(make_plan(), index)[0]["acceleration"]


def bound(signal):
    """Half a count of the channel's peak and the rounding of float32, (channel, sample)."""
    count = np.abs(signal).max(axis=-1, keepdims=True).astype(float) / 32767
    return HALF_COUNT * count + np.finfo(np.float32).eps * np.abs(signal)


def check_close(found, signal):
    """A signal differs from the one that was stored as counts by half a count."""
    assert found.dtype == np.float32
    assert (np.abs(found - signal) <= bound(signal)).all()


@pytest.mark.parametrize("peak", [3e38, 1.0, 1e-30, 1e-40, 1.5e-45])
def test_quantization_uses_the_whole_range_and_errs_by_half_a_count(peak):
    signal = np.random.default_rng(1).normal(size=(3, 5000))
    signal /= np.abs(signal).max(axis=1, keepdims=True)
    signal = (signal * peak).astype(np.float32)
    counts, scale = quantized(signal)
    assert counts.dtype == np.int16
    # -32768 would be one more
    assert (np.abs(counts.astype(int)).max(axis=1) == 32767).all()
    error = np.abs(counts * scale[:, None] - signal).max(axis=1)
    assert (error <= HALF_COUNT * scale).all()
    if peak > 1e-30:  # else float32 itself is as coarse as a count
        assert (error > 0.49 * scale).all()


def test_quantization_of_zero_constant_and_not_finite_channels():
    signal = np.zeros((5, 4), np.float32)
    signal[1] = -3.0
    signal[2, 1] = np.nan
    signal[3, 2] = -np.inf
    counts, scale = quantized(signal)
    assert counts[0].tolist() == counts[2].tolist() == counts[3].tolist() == [0] * 4
    assert scale[[0, 4]].tolist() == [1.0, 1.0]
    assert np.isnan(scale[[2, 3]]).all()
    assert counts[1].tolist() == [-32767] * 4
    assert_allclose(counts[1] * scale[1], -3.0, rtol=1e-15, atol=0)


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("sample_type", SAMPLE_TYPES)
def test_every_way_gives_the_signals_back(tmp_path, plan, compression, sample_type):
    path = tmp_path / "a.h5"
    way = {"compression": compression, "sample_type": sample_type}
    write_shard(path, plan, 1, failed=FAILED, clean=True, **way)
    with open_shard(path) as file:
        for name, factor in (("acceleration", 1), ("acceleration_clean", 0.5)):
            assert file[name].dtype == sample_type
            assert (SCALES[name] in file) == (sample_type == "int16")
            for row in range(10):
                result = read_signal(file, name, row)
                signal = factor * expected(10 + row)
                if row == FAILED - 10:
                    assert np.isnan(result).all()
                elif sample_type == "float32":
                    assert_array_equal(result, signal, strict=True)
                else:
                    check_close(result, signal)
        stored = file["acceleration"]
        assert compression_of(stored) == compression
        if compression == "blosc2":  # as docs/format.md says: level 5, bit shuffle, LZ4
            number, _, options, _ = stored.id.get_create_plist().get_filter(0)
            assert (number, options[4:7]) == (32026, (5, 2, 1))
        unit = {"int16": b"1", "float32": b"m/s^2"}[sample_type]
        assert stored.attrs["unit"] == unit


@pytest.mark.parametrize("sample_type", SAMPLE_TYPES)
@pytest.mark.parametrize(("status", "value"), [("ok", 0.0), ("failed", np.nan)])
def test_silent_and_failed_shards_are_read(tmp_path, sample_type, status, value):
    """Blosc2 stores a constant record in so few bytes that it looks like a bomb."""
    plan, shape, path = make_plan(n_records=2), (2, 60_000), tmp_path / "a.h5"
    storage = {"compression": "blosc2", "sample_type": sample_type}
    signals = {"ok": {"acceleration": np.zeros(shape)}}.get(status, {})
    with writer_of(path, 2, signals={"acceleration": shape}, **storage) as writer:
        for row in range(2):
            writer.write(row, signals, row_of(plan, row, status=status)[1])
    with open_shard(path) as file:
        result = read_signal(file, "acceleration", 1)
    assert_array_equal(result, np.full(shape, value))


def test_failed_record_keeps_the_channels_that_are_finite(tmp_path, plan):
    signals, values = row_of(plan, 0, status="failed")
    sound = signals["acceleration"][:1].copy()
    signals["acceleration"][1, 7] = np.inf
    path = tmp_path / "a.h5"
    with writer_of(path, sample_type="int16") as writer:
        writer.write(0, signals, values)
    with open_shard(path) as file:
        result = read_signal(file, "acceleration", 0)
    check_close(result[:1], sound)
    assert np.isnan(result[1]).all()


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_bytes_of_int16_depend_on_the_input_alone(
    tmp_path, plan, compression, monkeypatch
):
    kept = {"compression": compression, "sample_type": "int16"}
    first = write_shard(tmp_path / "a.h5", plan, **kept).sha256
    # Blosc2 obeys its environment, and writes into the file that it did
    for name, value in (("NTHREADS", "3"), ("CLEVEL", "1"), ("COMPRESSOR", "zstd")):
        monkeypatch.setenv(f"BLOSC_{name}", value)
    assert write_shard(tmp_path / "b.h5", plan, **kept).sha256 == first
    assert os.environ["BLOSC_NTHREADS"] == "3"
    assert write_shard(tmp_path / "c.h5", plan, compression=compression).sha256 != first


def test_reader_and_index_give_physical_values(whole):
    with open_dataset(whole) as data:
        assert (data.sample_type, data.compression) == ("int16", "blosc2")
        for index in (0, 9, 10, 35):
            signal, result = expected(index), data.signals(index)
            check_close(result, signal)
            part = data.signals(index, 20, 70, ["wheel_ü"])
            assert_array_equal(part, result[1:, 20:70])
            check_close(data.signals(index, name="acceleration_clean"), signal / 2)
        assert np.isnan(data.signals(FAILED)).all()
        scale = data.column("acceleration_scale")
        assert scale.shape == (36, 2)
        assert_array_equal(np.isnan(scale).all(axis=1), ~data.usable)
        assert data.usable.sum() == 35
        signals = [data.signals(index) for index in range(36)]
    with h5py.File(whole / "index.h5", locking=False) as index:
        assert index["acceleration"].attrs["scale"] == b"acceleration_scale"
        scale = index["acceleration_scale"][...][:, :, None]
        physical = (index["acceleration"][...] * scale).astype(np.float32)
    assert_array_equal(physical, signals)


def test_index_has_no_scale_of_a_missing_shard(whole, tmp_path):
    copy = shutil.copytree(whole, tmp_path / "set")
    shard_path(copy, 3).unlink()
    with h5py.File(copy / "index.h5", locking=False) as index:
        missing = np.isnan(index["acceleration_scale"][...]).all(axis=1)
    assert np.flatnonzero(missing).tolist() == [FAILED, *range(30, 36)]


def test_descriptions_name_the_scale(whole, folder):
    text = inspect(whole)
    assert "acceleration (2, 200) float32, m/s^2" in text
    assert "int16 with a scale, compression blosc2" in text
    assert "float32, compression none" in inspect(folder)
    assert "/acceleration (10, 2, 200) int16, 1, scale=acceleration_scale" in inspect(
        shard_path(whole, 0)
    )
    card = (whole / "README.md").read_text()
    assert "times acceleration_scale" in card
    assert "blosc2 (read with hdf5plugin)" in card
    assert "int16" not in (folder / "README.md").read_text()


def _first_sample(data, index):
    return float(data.signals(index)[0, 0])


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_read_blosc2(whole, method):
    """A file that is open here is opened anew, with its filter, in another process."""
    with open_dataset(whole) as data:
        work = [(data, index) for index in (0, 14, 24, 35)]
        here = [_first_sample(*words) for words in work]
        with multiprocessing.get_context(method).Pool(2) as pool:
            assert pool.starmap(_first_sample, work) == here
        assert [_first_sample(*words) for words in work] == here


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            setting(SCALE, (4, 1), np.nan),
            "shard-00001.h5 row 4: acceleration_scale is nan; it must be positive and",
        ),
        (setting(SCALE, (4, 1), np.inf), "row 4: acceleration_scale is inf"),
        (setting(SCALE, (4, 1), 0.0), "row 4: acceleration_scale is 0.0"),
        (setting(SCALE, (4, 1), -1e-3), "row 4: acceleration_scale is -0.001"),
        (setting(SCALE, (4, 1), 1e300), "row 4: acceleration is not finite"),
        (setting(SCALE, (FAILED - 10, 1), 0.0), "row 2: acceleration_scale is 0.0"),
        (
            setting("acceleration_clean_scale", (4, 1), -1.0),
            "row 4: acceleration_clean_scale is -1.0",
        ),
        (lambda file: file.pop(SCALE), "no data set acceleration_scale"),
        (
            lambda file: file.__setitem__(SCALE, file.pop(SCALE)[:, :1]),
            "acceleration_scale has shape (10, 1), acceleration has (10, 2)",
        ),
    ],
)
def test_verify_finds_a_scale_that_is_none(whole, tmp_path, change, message):
    folder = shutil.copytree(whole, tmp_path / "set")
    assert forge(folder, 1, lambda file: None) == ""  # forging alone changes nothing
    assert message in forge(folder, 1, change)


def test_verify_looks_at_signals_without_noise_too(tmp_path, plan):
    folder = build(tmp_path / "set", plan, clean=True)
    change = setting("acceleration_clean", (4, 1), np.nan)
    assert "row 4: acceleration_clean is not finite" in forge(folder, 1, change)


def test_reader_refuses_a_scale_that_is_none(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / "set")
    forge(folder, 1, setting(SCALE, (4, 1), 0.0))
    with open_dataset(folder) as data:
        data.signals(15)
        with refused("acceleration_scale of row 4 is 0.0", DatasetError):
            data.signals(14)


def test_missing_plugin_is_one_line(whole, tmp_path, plan, monkeypatch):
    monkeypatch.setitem(sys.modules, "hdf5plugin", None)
    needed = "blosc2.* needs the package hdf5plugin.*" + re.escape(install("blosc2"))
    for use in (
        lambda: write_shard(tmp_path / "a.h5", plan, compression="blosc2"),
        lambda: open_shard(shard_path(whole, 0)),
        lambda: open_dataset(whole),
    ):
        with pytest.raises(DatasetError, match=needed) as caught:
            use()
        assert "\n" not in str(caught.value)
    assert "needs the package hdf5plugin" in "\n".join(verify(whole).problems)
    assert list(tmp_path.iterdir()) == []
    other = build(tmp_path / "gzip", plan, compression="gzip", sample_type="int16")
    assert verify(other).complete  # needs it not


def test_blosc2_bombs_are_refused(tmp_path, plan, monkeypatch):
    path = tmp_path / "a.h5"
    write_shard(path, plan, compression="blosc2")
    with h5py.File(path, "r+") as file:
        options = file["acceleration"].id.get_create_plist()
        del file["acceleration"]
        space = h5py.h5s.create_simple((10, 2, 200))
        kind = h5py.h5t.IEEE_F32LE
        h5py.h5d.create(file.id, b"acceleration", kind, space, dcpl=options)
        file["acceleration"][:9] = 1.0  # the last record is never written
    with refused("never written or is a bomb", DatasetError):
        open_shard(path)
    write_shard(path, plan, compression="blosc2")
    open_shard(path).close()
    for module in (guard_module, shard_module):  # a record has 1600 bytes
        monkeypatch.setattr(module, "BLOSC2_CHUNK_LIMIT", 1599)
    with refused("bomb", DatasetError):
        open_shard(path)
    with refused("has 1600 bytes, blosc2 takes 1599", DatasetError):
        write_shard(path, plan, compression="blosc2")


def test_blosc2_takes_a_quarter_of_a_gibibyte(tmp_path):
    n_samples = 2**28 // 4 // 2  # of two channels

    def declare(n_samples):
        signals = SIGNALS | {"acceleration": (2, n_samples)}
        writer_of(tmp_path / "a.h5", compression="blosc2", signals=signals)

    declare(n_samples)
    with refused("has 268435464 bytes, blosc2 takes 2", DatasetError):
        declare(n_samples + 1)


def test_generate_refuses_before_it_touches_anything(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "hdf5plugin", None)
    words = ["--quiet", "dataset.compression=blosc2", f"out={tmp_path / 'set'}"]
    assert main(["generate", *words]) != 0
    (error,) = capsys.readouterr().err.splitlines()
    assert "dataset.compression=blosc2 needs the package hdf5plugin" in error
    assert list(tmp_path.iterdir()) == []
