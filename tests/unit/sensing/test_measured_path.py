"""Measured responses: what they do to a signal, and every file that is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused
from scipy.signal import fftconvolve, sosfilt

from gensig.sensing.measured_path import MeasuredPath, read_responses
from gensig.sensing.transfer_path import mode_section

RATE = 51200.0
CHANNELS, SENSORS = ("pinion_y", "wheel_y"), ("housing",)
PAIRS = ("pinion_y_to_housing", "wheel_y_to_housing")


def write(path, names, columns):
    table = np.column_stack(columns)
    np.savetxt(
        path,
        table,
        "%.12g",
        ",",
        header=",".join(names),
        comments="",
    )
    return str(path)


def impulse_file(path, taps, *, rate=RATE, names=PAIRS):
    return write(
        path,
        ["time_s", *names],
        [np.arange(len(taps[0])) / rate, *taps],
    )


def frequency_file(path, response, *, low=0.0, high=25_600.0, step=10.0):
    frequency = np.arange(low, high + 0.5 * step, step)
    values = [response(frequency), 0.5 * response(frequency)]
    names = [f"{pair}_{part}" for pair in PAIRS for part in ("real", "imaginary")]
    columns = [part for value in values for part in (value.real, value.imag)]
    return write(
        path,
        ["frequency_hz", *names],
        [frequency, *columns],
    )


def read(file, rate=RATE):
    return read_responses(MeasuredPath(file=file), CHANNELS, SENSORS, rate)


def mode(frequency, natural=2000.0, damping=0.03):
    ratio = frequency / natural
    return 1.0 / (1.0 - ratio**2 + 2j * damping * ratio)


def test_impulse_response_is_a_convolution(tmp_path):
    rng = np.random.default_rng(1)
    taps, source = rng.standard_normal((2, 64)), rng.standard_normal((2, 500))
    result = read(impulse_file(tmp_path / "h.csv", taps)).apply(source, RATE)
    expected = fftconvolve(source, taps, axes=1).sum(axis=0)[:500]

    assert_allclose(result, [expected], atol=1e-9)


@pytest.mark.parametrize("channels", [CHANNELS, CHANNELS[::-1]])
@pytest.mark.parametrize("sensors", [("housing", "lid"), ("lid", "housing")])
def test_every_pair_has_its_own_response(tmp_path_factory, channels, sensors):
    """Whatever order they were read in before."""
    names = ["pinion_y_to_housing", "wheel_y_to_housing"]
    names += ["pinion_y_to_lid", "wheel_y_to_lid"]
    file = tmp_path_factory.getbasetemp() / "pairs.csv"
    path = MeasuredPath(file=impulse_file(file, np.eye(4, 64), names=names))
    taps = read_responses(path, channels, sensors, RATE).taps
    for (row, column), first in np.ndenumerate(taps.argmax(axis=-1)):
        assert names[first] == f"{channels[column]}_to_{sensors[row]}"


def test_frequency_response_of_a_mode_rings_as_the_mode_does(tmp_path):
    path = read(frequency_file(tmp_path / "f.csv", mode, step=5.0))
    time = np.arange(8000) / RATE
    smooth = np.exp(-0.5 * ((time - 0.02) / 1e-4) ** 2)
    result = path.apply(np.stack([smooth, 0.0 * smooth]), RATE)[0]
    expected = sosfilt(mode_section(2000.0, 0.03, RATE), smooth)

    assert_allclose(
        result,
        expected,
        atol=0.01 * np.abs(expected).max(),
    )


def test_one_file_has_responses_at_every_rate(tmp_path):
    file = frequency_file(tmp_path / "f.csv", mode, low=15.0)
    assert [read(file, rate).sampling_rate for rate in (RATE, 0.5 * RATE)] == [
        RATE,
        0.5 * RATE,
    ]


def test_refused_files(tmp_path):
    taps = np.ones((2, 32))
    late_nan = np.where(
        np.arange(32) == 2,
        np.nan,
        1.0,
    )
    falling = [-np.arange(32) / RATE, *taps]
    names, more = ["time_s", *PAIRS], (*PAIRS, "wheel_z_to_housing")
    (tmp_path / "words").write_text("time_s,a\n1,two\n" * 20)

    def impulse(name, taps, **options):
        return impulse_file(tmp_path / name, taps, **options)

    def response(name, values, **options):
        return frequency_file(tmp_path / name, values, **options)

    cases = {
        "cannot be read": tmp_path / "none",
        "unknown column wheel_z_to_housing": impulse("b", [*taps, taps[0]], names=more),
        "no column wheel_y_to_housing": impulse("c", taps[:1], names=PAIRS[:1]),
        "row 4, column wheel_y_to_housing is no finite number": impulse(
            "d", [taps[0], late_nan]
        ),
        "too short: 8 rows, at least 16": impulse("e", taps[:, :8]),
        "has 25600 samples a second": impulse("f", taps, rate=25_600),
        "reaches from 0 to 5000 Hz; 20 to 20000 Hz is needed": response(
            "g", mode, high=5000.0
        ),
        "comes before time 0": response("a", lambda line: np.conj(mode(line))),
        "time_s must rise in even steps": write(tmp_path / "h", names, falling),
        "give numbers under one header": tmp_path / "words",
    }

    for text, file in cases.items():
        with refused(text) as caught:
            read(str(file))
        assert str(caught.value).startswith("sensing.path.file = ")
