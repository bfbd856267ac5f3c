"""Known measured sets in made-up folders of their layouts, and the sources of their facts."""

import hashlib
from collections import Counter

import numpy as np
import pytest
import yaml
from made_sets import MADE, N_SAMPLES
from refusals import refused

import gensig.measured
from gensig.measured import load, read_signal, read_signals, sets
from gensig.measured.measured_set import LABELS, specimens
from gensig.measured.set_facts import NOT_FACTS, RECORDING_KEYS, SHIPPED, shipped_facts

# label -> recordings of a made-up folder, None for classes that have none
COUNTS = {
    "hust_gearbox": {"healthy": 1, "one_tooth": 2},
    "mcc5_thu": {"healthy": 2, "one_tooth": 2, "many_teeth": 2, None: 2},
    "phm2009": {"healthy": 4, "one_tooth": 4, None: 2},
    "seu": {"healthy": 2, "one_tooth": 6, "many_teeth": 2},
    "uconn": {"healthy": 104, "one_tooth": 832},
}
# what no source states
ASKED = {
    "hust_gearbox": set(),
    "mcc5_thu": set(),
    "phm2009": set(),
    "seu": {"sampling_rate_hz", "stages"},
    "uconn": {"speed_rpm"},
}


@pytest.fixture(params=sorted(MADE))
def made(request, tmp_path):
    MADE[request.param](tmp_path)
    return request.param, tmp_path


def test_every_known_set_has_a_made_up_folder() -> None:
    assert set(sets()) == set(MADE)


def test_the_layout_is_found(made) -> None:
    name, folder = made
    found = load(name, folder)
    assert Counter(one.label for one in found.recordings) == COUNTS[name]
    assert set(found.missing) == ASKED[name]
    digests = {one.file: one.sha256 for one in found.recordings}
    for file, digest in digests.items():
        assert digest == hashlib.sha256(file.read_bytes()).hexdigest()


def test_samples_are_those_of_the_file(made) -> None:
    name, folder = made
    (folder / "measured.yaml").write_text(f"set: {name}\nsampling_rate_hz: 5000\n")
    found = load(name, folder)
    signal = read_signal(found.recordings[0])
    assert signal.sampling_rate == 5000
    n_samples = 1000 if name == "uconn" else N_SAMPLES
    n_channels = {"phm2009": 2, "uconn": 1}.get(name, 3)
    assert signal.acceleration.shape == (n_channels, n_samples)
    assert np.abs(signal.acceleration.mean(axis=1)).max() < 1e-9


def test_unstated_facts_are_asked_for_and_taken(tmp_path) -> None:
    MADE["seu"](tmp_path)
    with refused("sampling_rate_hz is not known; give it in measured"):
        read_signal(load("seu", tmp_path).recordings[0])
    facts = "set: seu\nsampling_rate_hz: 5120\nstages: [[29, 100], [36, 90]]\n"
    (tmp_path / "measured.yaml").write_text(facts)
    found = load("seu", tmp_path)
    assert found.missing == {}
    assert found.recordings[0].train.mesh_orders() == (29.0, 36 * 0.29)
    assert read_signal(found.recordings[0]).sensors == (
        "planetary_x",
        "planetary_y",
        "planetary_z",
    )


def test_columns_before_and_after_the_numbers_are_named_right(tmp_path) -> None:
    """The planetary channels are the second to the fourth column, HUST's the last three."""
    MADE["seu"](tmp_path)
    (tmp_path / "measured.yaml").write_text("set: seu\nsampling_rate_hz: 5120\n")
    first = load("seu", tmp_path).recordings[0]
    lines = first.file.read_text().splitlines()[16:]
    values = np.array([line.split()[1:4] for line in lines], dtype=float).T
    expected = values - values.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(read_signal(first).acceleration, expected, atol=1e-12)


def test_rows_of_one_file_are_recordings_in_its_order(tmp_path) -> None:
    MADE["uconn"](tmp_path)
    recordings = load("uconn", tmp_path).recordings
    assert [recordings[index].own_class for index in (0, 103, 104, 935)] == [
        "healthy",
        "healthy",
        "missing",
        "chip1a",
    ]
    few = recordings[100:103]
    for (one, signal), other in zip(read_signals(few), few, strict=True):
        assert one == other
        np.testing.assert_array_equal(
            signal.acceleration, read_signal(one).acceleration
        )


def test_g_becomes_m_per_s2(tmp_path) -> None:
    MADE["mcc5_thu"](tmp_path)
    first = load("mcc5_thu", tmp_path).recordings[0]
    column = np.loadtxt(first.file, delimiter=",", skiprows=1, usecols=5)
    np.testing.assert_allclose(
        read_signal(first).acceleration[0],
        9.80665 * (column - column.mean()),
        atol=1e-9,
    )


def test_names_tell_speed_and_load(tmp_path) -> None:
    MADE["mcc5_thu"](tmp_path)
    by_course = {one.speed_varies: one for one in load("mcc5_thu", tmp_path).recordings}
    assert by_course[False].shaft_frequency == pytest.approx(1000 / 60)
    assert by_course[False].load == "10 N m"
    assert by_course[True].shaft_frequency == pytest.approx(50.0)


def test_one_specimen_a_class_is_counted(tmp_path) -> None:
    MADE["hust_gearbox"](tmp_path)
    groups = specimens(load("hust_gearbox", tmp_path).recordings)
    assert {label: len(names) for label, names in groups.items()} == {
        "healthy": 1,
        "one_tooth": 2,
    }


@pytest.mark.parametrize("name", sorted(MADE))
def test_another_layout_is_one_line_with_what_is_there(name, tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    with refused("it holds notes.txt") as caught:
        load(name, tmp_path)
    assert "not laid out as " in str(caught.value)


@pytest.mark.parametrize("n_files", [1, 4, 5, 9])
def test_of_many_other_files_four_are_named_and_the_rest_counted(
    n_files, tmp_path
) -> None:
    names = [f"notes{index}.txt" for index in range(n_files)]
    for name in names:
        (tmp_path / name).write_text("nothing\n")
    with refused("it holds") as caught:
        load(sorted(MADE)[0], tmp_path)
    told = ", ".join(names[:4])
    if n_files > 4:
        told += f" and {n_files - 4} more"
    assert str(caught.value).endswith(f"it holds {told}")


@pytest.mark.parametrize("name", sorted(MADE))
def test_every_fact_has_a_source_or_a_reason(name) -> None:
    facts = shipped_facts(name)
    tree = yaml.safe_load((SHIPPED / f"{name}.yaml").read_text())
    stated = {
        key for key in tree if key not in NOT_FACTS and tree[key] not in ("", None)
    }
    stated |= {key for entry in tree["files"] for key in entry if key in RECORDING_KEYS}
    assert stated - {"machine"} == set(facts.stated_by)
    assert not stated & set(facts.not_stated)
    named = {source for sources in facts.stated_by.values() for source in sources}
    assert named <= set(facts.sources)
    for address in facts.sources.values():
        assert address.startswith(("https://", "github.com/"))


@pytest.mark.parametrize("name", sorted(MADE))
def test_labels_are_the_three(name) -> None:
    for kind in shipped_facts(name).files:
        assert {label for label in kind.classes.values() if label} <= set(LABELS)


def test_the_package_says_what_it_offers() -> None:
    assert {"load", "sets", "read_signal"} <= set(gensig.measured.__all__)
