"""Sizes by signal-to-noise ratios of diagnose detectability: laws, words, refusals."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gensig
from diagnose.cli import main
from diagnose.detectability.maps import make_maps
from diagnose.detectability.sampling import (
    found_from,
    make_sampling,
    read_axes,
)
from diagnose.detectability.sampling_text import found_lines, sampling_lines
from gensig.errors import ConfigError

SMALL = ("fault=crack", "operating.duration_s=0.1", "sensing.channels=[pinion_y]")
BANDS = (5000.0, 25600.0)
AT_SET_POINT = {"speeds_rpm": [1800.0], "torques_nm": [20.0], "n_units": 4}


def pairs_at(size, ratio, epoch=0):
    words = (f"fault.crack_depth_mm={size!r}", f"sensing.snr_db={ratio!r}")
    return gensig.fault_pairs(*SMALL, *words, **AT_SET_POINT, epoch=epoch)


@pytest.fixture(scope="module")
def sampling():
    base = gensig.fault_pairs(*SMALL, n_units=4)
    axes = read_axes(base, [3.0, 1.0], [20.0, 0.0])
    return make_sampling(axes, pairs_at, BANDS, n_workers=1, on_done=lambda _: None)


def test_it_grows_with_the_size_and_as_the_amplitude_of_noise_falls(sampling):
    known = sampling.values("known")
    assert (known[1] > known[0]).all()
    assert_allclose(known[:, 1], 10.0 * known[:, 0], rtol=1e-9, atol=0)


def test_a_sample_is_the_map_of_its_size_and_ratio(sampling):
    maps = make_maps(pairs_at(3.0, 0.0), BANDS, n_workers=1, on_done=lambda _: None)
    sample = sampling.samples[1][0]
    assert sample.known == maps.known.max()
    assert sample.seen == maps.seen.max()
    assert sample.on_others != sample.seen


def test_the_axes_of_a_fault_are_about_its_size():
    base = gensig.fault_pairs("fault=pitting", n_units=4)
    axes = read_axes(base, None, [10.0])
    assert axes.size_key == "pit_length_mm"
    assert axes.sizes == (0.25, 0.5, 1.0, 1.5, 2.0)
    assert read_axes(base, [1.0], None).snrs_db == (0.0, 10.0, 20.0, 30.0)


def test_found_is_what_stays_found_at_every_larger_size():
    values = np.array(
        [[0.0, 3.0, 3.0, np.nan], [3.0, 1.0, 3.0, 3.0], [3.0, 3.0, 3.0, 1.0]]
    )
    assert found_from(values, 2.0) == [1, 2, 0, None]


def test_the_words_answer_which_size_at_which_ratio(sampling):
    lines = sampling_lines(sampling)
    assert lines[1].split() == ["crack_depth_mm", "0", "dB", "20", "dB"]
    assert lines[-2:] == found_lines(sampling)
    assert lines[-2].startswith("at 0 dB the crack is found ")
    assert "already at 1 mm, the least sampled, by the filter" in lines[-1]


def test_the_command_writes_table_and_figure(tmp_path, capsys):
    table, figure = tmp_path / "s.json", tmp_path / "s.png"
    flags = (
        f"--sizes 1 3 --snrs 10 --n-units 4 --workers 1 --json {table} --plot {figure}"
    )
    assert main(["detectability", *SMALL, *flags.split()]) == 0
    said = capsys.readouterr().out.splitlines()
    content = json.loads(table.read_text())
    assert content["summary"] == said[-1:]
    assert [row["size"] for row in content["samples"]] == [1.0, 3.0]
    assert content["size_key"] == "crack_depth_mm"
    assert {row["snr_db"] for row in content["samples"]} == {10.0}
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_too_many_samples_are_refused():
    base = gensig.fault_pairs(*SMALL, n_units=4)
    with pytest.raises(ConfigError, match="51 sizes x 2 ratios are more than 100"):
        read_axes(base, np.linspace(0.1, 3.0, 51), [0.0, 10.0])
