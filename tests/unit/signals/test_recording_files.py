"""Every format of a recording says the same; what cannot be used is refused with one line."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import given, refused
from scipy import io
from scipy.io import wavfile

from gensig.signals.recording import read_file, recording_of

RATE = 5120.0
SIGNAL = np.random.default_rng(1).standard_normal((2, 2000))
CENTRED = SIGNAL - SIGNAL.mean(axis=1, keepdims=True)


def write_mat73(path, content):
    """MATLAB's own layout: a block of text before HDF5, arrays transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            file[name] = np.asarray(value).T
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_hdf5(path, content, **attributes):
    with h5py.File(path, "w") as file:
        for name, value in content.items():
            file[name] = value
        file.attrs.update(attributes)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same recording in every format that tells its rate."""
    folder = tmp_path_factory.mktemp("recordings")
    table = np.column_stack([np.arange(SIGNAL.shape[1]) / RATE, *SIGNAL])
    np.savetxt(
        folder / "r.csv",
        table,
        "%.17g",
        ",",
        header="time_s,a,b",
        comments="",
    )
    wavfile.write(
        folder / "r.wav",
        int(RATE),
        SIGNAL.T,
    )
    content = {"acceleration": SIGNAL, "sampling_rate_hz": RATE}
    tall = content | {"acceleration": SIGNAL.T}
    np.savez(folder / "r.npz", **content)
    write_hdf5(folder / "r.h5", {"acceleration": SIGNAL}, sampling_rate_hz=RATE)
    write_hdf5(folder / "r.hdf5", content)
    io.savemat(folder / "r.mat", content)
    io.savemat(folder / "tall.mat", tall, do_compression=True)
    write_mat73(
        folder / "r73.mat",
        tall | {"sampling_rate_hz": [[RATE]]},
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
    assert_allclose(recording_of(source).acceleration, CENTRED, atol=1e-12)


@pytest.mark.parametrize(
    ("stored", "given", "rate"),
    [(5120.001, None, 5120.0), (5120.5, None, 5120.5), (5120.5, 5121.0, 5121.0)],
)
def test_the_rate_of_a_table_is_rounded_or_as_given(tmp_path, stored, given, rate):
    table = np.column_stack([np.arange(2000) / stored, SIGNAL[0]])
    file = tmp_path / "r.csv"
    np.savetxt(file, table, "%.17g", ",", header="time_s,a", comments="")
    result = read_file(str(file), rate=given).sampling_rate
    assert_allclose(result, rate, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "array"),
    [("c.mat", "X097_DE_time"), ("c.h5", "run/one"), ("c.npy", None)],
)
def test_an_array_by_its_name(tmp_path, name, array):
    io.savemat(
        tmp_path / "c.mat",
        {"X097_DE_time": SIGNAL[:1].T, "X097RPM": 1796.0},
    )
    write_hdf5(tmp_path / "c.h5", {"run/one": SIGNAL[0]})
    np.save(tmp_path / "c.npy", SIGNAL[0])
    source = read_file(
        str(tmp_path / name),
        rate=RATE,
        array=array,
    )

    assert_allclose(
        recording_of(source).acceleration,
        CENTRED[:1],
        atol=1e-12,
    )


def test_whole_numbers_of_a_wav_file_keep_their_shape_and_have_no_level(tmp_path):
    whole = np.round(1000.0 * SIGNAL.T).astype(np.int16)
    wavfile.write(tmp_path / "i.wav", int(RATE), whole)
    source = read_file(str(tmp_path / "i.wav"))
    result = recording_of(source, needs_level=False).acceleration

    assert np.corrcoef(result[0], SIGNAL[0])[0, 1] > 0.99999
    with refused("no level in m/s2"):
        recording_of(source)


class Payload:
    """Leaves a trace where it is unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('unpickled')",))


# a file and options: words of the message
REFUSED = {
    "r.flac": "the name must end in .csv, .npy, .npz, .wav",
    "none.wav": "No such file",
    "none.h5 rate=5120.0": "No such file",
    "garbage.wav": "it is no WAV file",
    "garbage.mat rate=5120.0": "it is no MATLAB file",
    "garbage.h5 rate=5120.0": "it is no HDF5 file",
    "cut.h5 rate=5120.0": "it is no HDF5 file",
    "garbage.npz rate=5120.0": "it is no plain array",
    "objects.npz rate=5120.0": "it is no plain array",
    "nan.mat rate=5120.0": "sample 7 of channel_1 is no finite number",
    "cell.mat rate=5120.0": "give one array of real numbers",
    "shard.h5": "give one array of real numbers",
    "tall.h5": "transpose it",
    "other.mat rate=5120.0": "no array acceleration; it has velocity; name one with --array",
    "other.mat rate=5120.0 array='speed'": "no array speed; it has velocity",
    "rates.mat": "sampling_rate_hz must be one number",
    "slow.mat": "3.0 samples a second, which must lie in 1000..1000000",
    "other.mat array='velocity' rate_option='--sampling-rate'": (
        "an array tells no rate; give the samples a second with --sampling-rate"
    ),
    "r.wav rate=6000.0": "its header has 5120 samples a second, --rate says 6000; leave --rate out",
    "r.wav array='x'": "--array is for .npz",
    "back.csv array='x'": "--array is for .npz",
    "back.csv": "time_s must rise in even steps",
    "round.csv": "time_s must rise in even steps",
    "times.csv": "there is no column beside time_s",
    "archive.npy rate=5120.0": "it is no plain array",
    "array.npz rate=5120.0": "it is no plain array",
    "link.h5 rate=5120.0": "no array acceleration; it has nothing",
    "virtual.h5 rate=5120.0": "no array acceleration; it has nothing",
    "huge.h5 rate=5120.0": "is larger than 500 MB",
}


@pytest.mark.parametrize(("words", "text"), REFUSED.items())
def test_refused(broken_files, words, text):
    name, _, options = words.partition(" ")
    with refused(text):
        recording_of(read_file(str(broken_files / name), **given(options)))


@pytest.fixture(scope="module")
def broken_files(tmp_path_factory):
    """Folder of files that are no usable recordings."""
    folder = tmp_path_factory.mktemp("broken")
    bad = SIGNAL.copy()
    bad[1, 7] = np.nan
    content = {"acceleration": SIGNAL}
    matlab = {
        "nan": {"acceleration": bad},
        "cell": {"acceleration": np.array([{"a": 1.0}, 2.0], dtype=object)},
        "other": {"velocity": SIGNAL},
        "rates": content | {"sampling_rate_hz": [1.0, 2.0]},
        "slow": content | {"sampling_rate_hz": 3.0},
    }
    for name, arrays in matlab.items():
        io.savemat(folder / f"{name}.mat", arrays)
    time = np.arange(300) / RATE
    around = np.append(time[:-1], time[0])  # begins anew at its end
    tables = {"back": (-time, time), "round": (around, time), "times": (time,)}
    for name, columns in tables.items():
        header = ",".join(["time_s", "a"][: len(columns)])
        path = folder / f"{name}.csv"
        np.savetxt(path, np.transpose(columns), "%.9g", ",", header=header, comments="")
    with open(folder / "archive.npy", "wb") as file:
        np.savez(file, acceleration=SIGNAL)
    with open(folder / "array.npz", "wb") as file:
        np.save(file, SIGNAL)
    for ending in ("wav", "mat", "h5", "npz"):
        (folder / f"garbage.{ending}").write_bytes(b"no recording at all " * 40)
    np.savez(
        folder / "objects.npz",
        acceleration=np.array([Payload()], dtype=object),
    )
    shapes = {
        "shard": SIGNAL[None],
        "tall": SIGNAL.T,
        "target": SIGNAL,
    }
    for name, values in shapes.items():
        write_hdf5(
            folder / f"{name}.h5",
            {"acceleration": values},
            sampling_rate_hz=RATE,
        )
    target = folder / "target.h5"
    link = h5py.ExternalLink(str(target), "/acceleration")
    write_hdf5(folder / "link.h5", {"acceleration": link})
    layout = h5py.VirtualLayout(SIGNAL.shape, float)
    layout[:] = h5py.VirtualSource(
        str(target),
        "acceleration",
        SIGNAL.shape,
    )
    with h5py.File(folder / "virtual.h5", "w") as file:
        file.create_virtual_dataset("acceleration", layout)
    with h5py.File(folder / "huge.h5", "w") as file:
        file.create_dataset(
            "acceleration",
            (2, 10**9),
            "f8",
            chunks=(1, 10**6),
        )
    wavfile.write(
        folder / "r.wav",
        int(RATE),
        SIGNAL.T,
    )
    whole = target.read_bytes()
    (folder / "cut.h5").write_bytes(whole[: len(whole) // 2])
    return folder
