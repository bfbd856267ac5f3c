"""Every format of a recording says the same; what cannot be used is refused with one line."""

import re

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import io
from scipy.io import wavfile

from gensig.errors import ConfigError
from gensig.signals.recording import read_file, recording_of

RATE = 5120.0
SIGNAL = np.random.default_rng(1).standard_normal((2, 2000))


def write_mat73(path, content):
    """MATLAB's own layout: a block of text before HDF5, arrays transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            file[name] = np.asarray(value).T
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_hdf5(path, content, rate=None):
    with h5py.File(path, "w") as file:
        for name, value in content.items():
            file[name] = value
        if rate is not None:
            file.attrs["sampling_rate_hz"] = rate


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same recording in every format that tells its rate."""
    folder = tmp_path_factory.mktemp("recordings")
    table = np.column_stack([np.arange(SIGNAL.shape[1]) / RATE, *SIGNAL])
    np.savetxt(folder / "r.csv", table, "%.17g", ",", header="time_s,a,b", comments="")
    wavfile.write(folder / "r.wav", int(RATE), SIGNAL.T)
    content = {"acceleration": SIGNAL, "sampling_rate_hz": RATE}
    np.savez(folder / "r.npz", **content)
    write_hdf5(folder / "r.h5", {"acceleration": SIGNAL}, RATE)
    write_hdf5(folder / "r.hdf5", content)
    io.savemat(folder / "r.mat", content)
    io.savemat(
        folder / "tall.mat", {**content, "acceleration": SIGNAL.T}, do_compression=True
    )
    write_mat73(
        folder / "r73.mat", {"acceleration": SIGNAL.T, "sampling_rate_hz": [[RATE]]}
    )
    return folder


@pytest.mark.parametrize(
    "name",
    ["r.csv", "r.wav", "r.npz", "r.h5", "r.hdf5", "r.mat", "tall.mat", "r73.mat"],
)
def test_all_formats_say_the_same(files, name):
    source = read_file(str(files / name))
    assert source.sampling_rate == RATE
    assert source.named == (name == "r.csv")
    result = recording_of(source).acceleration
    assert_allclose(result, SIGNAL - SIGNAL.mean(axis=1, keepdims=True), atol=1e-12)


def test_an_array_by_its_name(tmp_path):
    io.savemat(tmp_path / "c.mat", {"X097_DE_time": SIGNAL[:1].T, "X097RPM": 1796.0})
    write_hdf5(tmp_path / "c.h5", {"run/one": SIGNAL[0]})
    np.save(tmp_path / "c.npy", SIGNAL[0])
    for name, array in (
        ("c.mat", "X097_DE_time"),
        ("c.h5", "run/one"),
        ("c.npy", None),
    ):
        result = recording_of(read_file(str(tmp_path / name), rate=RATE, array=array))
        assert_allclose(
            result.acceleration[0], SIGNAL[0] - SIGNAL[0].mean(), atol=1e-12
        )


def test_whole_numbers_of_a_wav_file_keep_their_shape_and_have_no_level(tmp_path):
    wavfile.write(
        tmp_path / "i.wav", int(RATE), np.round(1000.0 * SIGNAL.T).astype(np.int16)
    )
    source = read_file(str(tmp_path / "i.wav"))
    result = recording_of(source, needs_level=False).acceleration
    assert np.corrcoef(result[0], SIGNAL[0])[0, 1] > 0.99999
    with pytest.raises(ConfigError, match="no level in m/s2"):
        recording_of(source)


class Payload:
    """Leaves a trace where it is unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('unpickled')",))


def refused(folder):
    """Text of the line, file, options."""
    bad = SIGNAL.copy()
    bad[1, 7] = np.nan
    io.savemat(folder / "nan.mat", {"acceleration": bad})
    io.savemat(
        folder / "cell.mat", {"acceleration": np.array([{"a": 1.0}, 2.0], dtype=object)}
    )
    io.savemat(folder / "other.mat", {"velocity": SIGNAL})
    io.savemat(
        folder / "rates.mat", {"acceleration": SIGNAL, "sampling_rate_hz": [1.0, 2.0]}
    )
    io.savemat(folder / "slow.mat", {"acceleration": SIGNAL, "sampling_rate_hz": 3.0})
    for name in ("garbage.wav", "garbage.mat", "garbage.h5", "garbage.npz"):
        (folder / name).write_bytes(b"no recording at all " * 40)
    np.savez(folder / "objects.npz", acceleration=np.array([Payload()], dtype=object))
    write_hdf5(folder / "shard.h5", {"acceleration": SIGNAL[None]}, RATE)
    write_hdf5(folder / "tall.h5", {"acceleration": SIGNAL.T}, RATE)
    write_hdf5(folder / "target.h5", {"acceleration": SIGNAL}, RATE)
    with h5py.File(folder / "link.h5", "w") as file:
        file["acceleration"] = h5py.ExternalLink(
            str(folder / "target.h5"), "/acceleration"
        )
    with h5py.File(folder / "virtual.h5", "w") as file:
        layout = h5py.VirtualLayout(SIGNAL.shape, float)
        layout[:] = h5py.VirtualSource(
            str(folder / "target.h5"), "acceleration", SIGNAL.shape
        )
        file.create_virtual_dataset("acceleration", layout)
    with h5py.File(folder / "huge.h5", "w") as file:
        file.create_dataset("acceleration", (2, 10**9), "f8", chunks=(1, 10**6))
    wavfile.write(folder / "r.wav", int(RATE), SIGNAL.T)
    whole = (folder / "target.h5").read_bytes()
    (folder / "cut.h5").write_bytes(whole[: len(whole) // 2])
    rated = {"rate": RATE}
    return [
        ("the name must end in .csv, .npy, .npz, .wav", "r.flac", {}),
        ("No such file", "none.wav", {}),
        ("No such file", "none.h5", rated),
        ("it is no WAV file", "garbage.wav", {}),
        ("it is no MATLAB file", "garbage.mat", rated),
        ("it is no HDF5 file", "garbage.h5", rated),
        ("it is no HDF5 file", "cut.h5", rated),
        ("it is no plain array", "garbage.npz", rated),
        ("it is no plain array", "objects.npz", rated),
        ("sample 7 of channel_1 is no finite number", "nan.mat", rated),
        ("give one array of real numbers", "cell.mat", rated),
        ("give one array of real numbers", "shard.h5", {}),
        ("transpose it", "tall.h5", {}),
        (
            "no array acceleration; it has velocity; name one with --array",
            "other.mat",
            rated,
        ),
        ("no array speed; it has velocity", "other.mat", {**rated, "array": "speed"}),
        ("sampling_rate_hz must be one number", "rates.mat", {}),
        ("3.0 samples a second, which must lie in 1000..1000000", "slow.mat", {}),
        (
            "an array tells no rate; give the samples a second with --sampling-rate",
            "other.mat",
            {"array": "velocity", "rate_option": "--sampling-rate"},
        ),
        (
            "its header has 5120 samples a second, --rate says 6000; leave --rate out",
            "r.wav",
            {"rate": 6000.0},
        ),
        ("--array is for .npz", "r.wav", {"array": "x"}),
        ("no array acceleration; it has nothing", "link.h5", rated),
        ("no array acceleration; it has nothing", "virtual.h5", rated),
        ("is larger than 500 MB", "huge.h5", rated),
    ]


def test_refused(tmp_path):
    for text, name, options in refused(tmp_path):
        with pytest.raises(ConfigError, match=re.escape(text)) as caught:
            recording_of(read_file(str(tmp_path / name), **options))
        assert "\n" not in str(caught.value)
