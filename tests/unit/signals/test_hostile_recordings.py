"""Recordings of strangers: whatever they do to a reader, the user gets values or one line."""

import io as streams
import os
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from hostile_readers import Content
from numpy.testing import assert_array_equal
from refusals import given, refused
from scipy import io
from scipy.io import wavfile

from gensig.errors import ConfigError
from gensig.signals.reading.reader_process import Limits, limits_for, read_apart
from gensig.signals.recording import TYPES, read_file

RATE = 5120
SIGNAL = np.random.default_rng(1).standard_normal((2, 2000))
PLENTY = Limits(memory_bytes=3_000_000_000, cpu_seconds=60, seconds=120.0)
DATA_TYPE = 192  # byte of a .mat file of version 5: type of the first array's values


def by(reader, file="r.mat", limits=PLENTY):
    return read_apart(f"hostile_readers:{reader}", str(file), None, limits)


@pytest.mark.parametrize(
    ("reader", "message"),
    [
        ("reads_nothing", "its reader crashed (SIGSEGV)"),
        ("aborts", "its reader crashed (SIGABRT)"),
        ("allocates", "needs more memory"),
        ("raises", "its reader ended with status 1"),
        ("leaves", "its reader ended with status 0"),
        ("promises_more", "its reader ended with status 0"),
        ("promises_ten_gigabytes", "is larger than 500 MB"),
        ("promises_less_than_nothing", "its reader ended with status 0"),
        ("answers_nonsense", "its reader ended with status 0"),
        ("answers_a_list", "its reader ended with status 0"),
        ("is_large", "is larger than 500 MB"),
    ],
)
def test_what_happens_to_a_reader_is_one_line(reader, message):
    with refused(message):
        by(reader)


@pytest.mark.parametrize(
    ("reader", "seconds", "message"),
    [("sleeps", 3.0, "more than 3 s;"), ("computes", 60.0, "more than 1 s of comp")],
)
def test_a_reader_that_does_not_end_is_ended(reader, seconds, message):
    limits = Limits(memory_bytes=10**9, cpu_seconds=1, seconds=seconds)
    with refused(f"its reader took {message}"):
        by(reader, limits=limits)


def test_what_a_library_prints_is_no_answer():
    assert_array_equal(by("prints").values, np.arange(6.0).reshape(2, 3))


def test_a_message_is_one_printable_line():
    with refused(r"a\nb \x1b[31mxxx") as caught:
        by("names")
    assert len(str(caught.value)) == 1000
    assert str(caught.value).isprintable()


def test_a_reader_writes_no_file_and_has_no_children(tmp_path):
    assert_array_equal(by("tells_its_limits").values, [[0.0, 0.0, 0.0]])
    file = tmp_path / "kept"
    with refused("its reader ended with status 1"):
        by("writes", file)
    assert file.read_bytes() == b""


def test_the_reader_dies_with_its_parent():
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]; "
        "from test_hostile_recordings import by; by('sleeps')"
    )
    parent = subprocess.Popen([sys.executable, "-c", code, *sys.path])
    assert wait_for(lambda: children(parent.pid))
    (child,) = children(parent.pid)
    parent.kill()
    parent.wait()
    assert wait_for(lambda: state(child) in ("ended", "Z"))


def wait_for(condition):
    """True as soon as the condition holds, False where it does not within a minute."""
    for _ in range(600):
        if condition():
            return True
        time.sleep(0.1)
    return False


def children(parent):
    """Numbers of the processes that a process started."""
    numbers = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [number for number in numbers if stat_line(number)[1:2] == [str(parent)]]


def state(process):
    """Letter of a process's state, as in /proc; ``ended`` where there is none."""
    return (stat_line(process) or ["ended"])[0]


def stat_line(process):
    """Words of /proc/NUMBER/stat after the name of the program."""
    try:
        text = Path(f"/proc/{process}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return []
    return text.rpartition(")")[2].split()


def test_a_script_without_a_guard_reads_a_recording(tmp_path):
    """The process of the reader does not run the user's script again."""
    np.save(tmp_path / "r.npy", SIGNAL)
    script = tmp_path / "mine.py"
    script.write_text(
        "from gensig.signals.recording import read_file\n"
        f"print(read_file('r.npy', rate={RATE}.0).values.shape)\n"
    )
    (tmp_path / "h5py.py").write_text("raise SystemExit('a module of the folder')\n")
    result = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True
    )
    assert result.stdout == "(2, 2000)\n", result.stderr


def test_limits_grow_with_the_file():
    small, large = limits_for(80_000), limits_for(500_000_000)
    assert small.cpu_seconds < 60 < large.cpu_seconds
    assert small.seconds > small.cpu_seconds


def matlab(path, **options):
    io.savemat(
        path, {"acceleration": SIGNAL, "sampling_rate_hz": float(RATE)}, **options
    )
    return bytearray(path.read_bytes())


def test_a_matlab_file_that_crashes_its_reader(tmp_path):
    """One byte: scipy 1.17 looks up the type of the values in a table without its end."""
    file = tmp_path / "r.mat"
    data = matlab(file)
    read_file(str(file))
    data[DATA_TYPE] = 0xC1
    file.write_bytes(data)
    with refused("cannot be read: it"):
        read_file(str(file))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("is_compressed", [False, True])
def test_a_changed_matlab_file_gives_values_or_one_line(seed, is_compressed, tmp_path):
    file = tmp_path / "r.mat"
    data = matlab(file, do_compression=is_compressed)
    rng = np.random.default_rng(seed)
    for place in rng.integers(128, 260, size=4):
        data[place] = rng.integers(256)
    file.write_bytes(data)
    check_values_or_one_line(file)


def check_values_or_one_line(file):
    """A changed file has values or is refused in one printable line."""
    text, n_axes = str(file), 2
    try:
        n_axes = read_file(str(file), rate=float(RATE)).values.ndim
    except ConfigError as error:
        text = str(error)
    assert n_axes == 2
    assert text.isprintable()
    assert str(file) in text


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Good files of every type."""
    folder = tmp_path_factory.mktemp("whole")
    content = {"acceleration": SIGNAL, "sampling_rate_hz": float(RATE)}
    columns = np.column_stack([np.arange(2000) / RATE, *SIGNAL])
    np.savetxt(
        folder / "r.csv", columns, "%.17g", ",", header="time_s,a,b", comments=""
    )
    wavfile.write(folder / "r.wav", RATE, SIGNAL.T)
    np.save(folder / "r.npy", SIGNAL)
    np.savez(folder / "r.npz", **content)
    io.savemat(folder / "r.mat", content)
    for ending in ("h5", "hdf5"):
        with h5py.File(folder / f"r.{ending}", "w") as file:
            for name, value in content.items():
                file[name] = value
    return folder


def test_every_type_has_a_good_file(whole):
    assert {path.suffix for path in whole.iterdir()} == set(TYPES)
    for path in whole.iterdir():
        assert_array_equal(read_file(str(path), rate=float(RATE)).values, SIGNAL)


@pytest.mark.parametrize("ending", [ending for ending in TYPES if ending != ".csv"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.99])
def test_a_file_that_is_cut_is_refused(ending, share, whole, tmp_path):
    data = (whole / f"r{ending}").read_bytes()
    file = tmp_path / f"cut{ending}"
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(ConfigError, match=r"^[^\n]+$"):
        read_file(str(file), rate=float(RATE))


@pytest.mark.parametrize("ending", TYPES)
@pytest.mark.parametrize("seed", range(3))
def test_changed_bytes_give_values_or_one_line(ending, seed, whole, tmp_path):
    data = bytearray((whole / f"r{ending}").read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(min(len(data), 400), size=8):
        data[place] = rng.integers(256)
    file = tmp_path / f"changed{ending}"
    file.write_bytes(data)
    check_values_or_one_line(file)


TEN_GB = 10**10
FLOATS = TEN_GB // 8


def npy(shape, n_bytes=800):
    """A .npy file whose header says more than it holds."""
    stream = streams.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue() + bytes(n_bytes)


def archive(data):
    stream = streams.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("acceleration.npy", data)
    return stream.getvalue()


def riff(size, name=b"RIFF", large=None):
    """A WAV file of one channel of float64 whose samples are promised to be so long."""
    chunks = b""
    if large is not None:
        chunks += b"ds64" + struct.pack("<IQQQI", 28, large, large, large // 8, 0)
    form = struct.pack("<HHIIHH", 3, 1, RATE, 8 * RATE, 8, 64)
    chunks += b"fmt " + struct.pack("<I", 16) + form
    chunks += b"data" + struct.pack("<I", size) + bytes(800)
    return name + struct.pack("<I", 0xFFFFFFFF) + b"WAVE" + chunks


def element(kind, size, content=b""):
    return struct.pack("<II", kind, size) + content


def matrix(n_samples, size):
    """An array of a .mat file that is promised to be so long."""
    flags = element(6, 8, struct.pack("<II", 6, 0))
    dims = element(5, 8, struct.pack("<ii", 1, n_samples))
    name = element(1, 12, b"acceleration" + bytes(4))
    return element(14, size, flags + dims + name + element(9, 8 * 100, bytes(800)))


HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
SHORT = len(matrix(0, 0)) - 8
INNER = zlib.compress(matrix(1_250_000_000, 0xF0000000))
OLD = struct.pack("<5i", 0, 1, 1_250_000_000, 0, 13) + b"acceleration\x00" + bytes(800)

PROMISES = {
    "more values than there are.npy": npy((1, FLOATS)),
    "more values than a number holds.npy": npy((2**62, 2**62)),
    "four hundred megabytes.npy": npy((1, 50_000_000)),
    "a negative length.npy": npy((-1, -8)),
    "a long header.npy": b"\x93NUMPY\x02\x00"
    + struct.pack("<I", 2**32 - 1)
    + bytes(80),
    "more values than there are.npz": archive(npy((1, FLOATS))),
    "four hundred megabytes.npz": archive(npy((1, 50_000_000))),
    "zeros.npz": archive(npy((1, 70_000_000), 560_000_000)),
    "text.npz": archive(b"0" * 700_000_000),
    "more samples than there are.wav": riff(4_000_000_000),
    "half a file of samples.wav": riff(400_000_000),
    "a size of its own.wav": riff(0xFFFFFFFF, b"RF64", TEN_GB),
    "without an end.wav": riff(0xFFFFFFFF),
    "a shape.mat": HEADER + matrix(1_250_000_000, SHORT),
    "a size.mat": HEADER + matrix(100, 4_000_000_000),
    "a size and a shape.mat": HEADER + matrix(50_000_000, 400_000_064),
    "compressed.mat": HEADER + element(15, len(INNER), INNER),
    "version 4.mat": OLD,
}


@pytest.mark.parametrize("name", PROMISES)
def test_a_promise_is_refused_before_anything_is_allocated(name, tmp_path):
    """In a process that has less memory than was promised."""
    file = tmp_path / name
    file.write_bytes(PROMISES[name])
    reader = f"gensig.signals.reading.recording_files:read_{file.suffix[1:]}"
    limits = Limits(memory_bytes=390_000_000, cpu_seconds=30, seconds=60.0)
    with pytest.raises(ConfigError, match=r"^[^\n]+$") as caught:
        read_apart(reader, str(file), None, limits)
    text = str(caught.value)
    assert "memory" not in text
    assert "crashed" not in text
    assert "more than" not in text


def dataset(path, name="acceleration", shape=(1, FLOATS), **options):
    with h5py.File(path, "a") as file:
        file.create_dataset(name, shape, "f8", **options)


@pytest.mark.parametrize(
    ("options", "message"),
    {
        "chunks=(1,10000)": "is larger than 500 MB",
        "chunks=(1,10000) compression='gzip'": "is larger than 500 MB",
        "": "is larger than 500 MB",
        "shape=(1,2000) maxshape=(1,None) chunks=(1,70000000)": (
            "a chunk of /acceleration is larger than 500 MB"
        ),
    }.items(),
)
@pytest.mark.parametrize("ending", ["h5", "hdf5", "mat"])
def test_a_promise_of_hdf5_is_refused(options, message, ending, tmp_path):
    file = tmp_path / f"r.{ending}"
    dataset(file, **given(options))
    with refused(message):
        read_file(str(file), rate=float(RATE))


def test_a_rate_of_ten_gigabytes_is_refused(tmp_path):
    file = tmp_path / "r.h5"
    dataset(file, shape=(2, 2000))
    dataset(file, "sampling_rate_hz", chunks=(1, 10_000))
    with refused("/sampling_rate_hz is larger than 500 MB"):
        read_file(str(file))


@pytest.mark.parametrize("name", ["r.csv", "r.npy", "r.mat"])
def test_what_is_no_file_is_not_waited_for(name, tmp_path):
    os.mkfifo(tmp_path / name)
    with refused("it is no file"):
        read_file(str(tmp_path / name), rate=float(RATE))


def test_the_answer_is_that_of_the_reader(whole):
    from gensig.signals.reading.recording_files import read_mat

    here = read_mat(str(whole / "r.mat"), None)
    there = read_apart(
        "gensig.signals.reading.recording_files:read_mat",
        str(whole / "r.mat"),
        None,
        PLENTY,
    )
    assert isinstance(there, Content)
    assert_array_equal(there.values, here.values)
    facts = ("sampling_rate", "rate_from", "has_level", "names")
    assert [getattr(there, fact) for fact in facts] == [
        getattr(here, fact) for fact in facts
    ]
