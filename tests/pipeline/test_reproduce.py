"""Records made once more from a data set: the same bits, and a twin that differs by the fault."""

import json
import re
import shutil

import h5py
import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from small_sets import TINY, make

from gensig.cli import main
from gensig.dataset.storage.atomic import sha256_file
from gensig.production import reproduction
from gensig.production.reproduction import ACCEPTED

SET = (
    "dataset.records_per_shard=4",
    "dataset.store_clean=true",
    "dataset.store_tacho=true",
    "dataset.store_mesh_state=true",
    "dataset.store_encoder=true",
)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    vary = "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}"
    return make(tmp_path_factory.mktemp("reference") / "data", *SET, vary)


@pytest.fixture
def reproduce(capsys):
    """Exit status and text of ``gensig reproduce``."""

    def run(folder, *words):
        capsys.readouterr()
        status = main(["reproduce", str(folder), *words])
        return status, capsys.readouterr().out

    return run


def test_every_record_has_the_same_bits(reference, reproduce):
    assert reproduce(reference) == (0, "6 of 6 records have the same bits\n")


def test_whole_numbers_of_two_channels_have_the_same_bits(tmp_path, reproduce):
    channels = "sensing.channels=[pinion_x,pinion_y]"
    folder = make(tmp_path / "data", "dataset.sample_type=int16", channels)
    assert reproduce(folder) == (0, "6 of 6 records have the same bits\n")


@pytest.mark.parametrize(
    ("given", "n"), [("r000003", 1), ("r000005,r000001,1", 2), ("2e0", 2), ("99", 6)]
)
def test_records_are_named_or_counted(reference, reproduce, given, n):
    said = reproduce(reference, "--records", given)
    assert said == (0, f"{n} of {n} records have the same bits\n")


@pytest.mark.parametrize(
    ("given", "answer"),
    [
        ("r000009", "--records r000009: .* has records 0 to 5, ids r000000 to r000005"),
        ("0,crack", "--records crack: "),
        ("0", "--records 0 must be at least 1"),
        (",", "--records , must be at least 1, or name records"),
        ("1.5", "--records 1.5: "),
    ],
)
def test_a_record_that_is_none_is_refused(reference, capsys, given, answer):
    assert main(["reproduce", str(reference), "--records", given]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(answer, line)


def edit_manifest(folder, change):
    file = folder / "manifest.json"
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


def test_a_set_that_names_a_later_key_at_its_default_goes_on(
    reference, tmp_path, reproduce
):
    """The missing key and its default are one configuration."""
    folder = shutil.copytree(reference, tmp_path / "data")
    config = yaml.safe_load((folder / "config.yaml").read_text())
    assert "n_reference" not in config["plan"]
    config["plan"]["n_reference"] = 0
    (folder / "config.yaml").write_text(yaml.safe_dump(config, sort_keys=False))
    equal = (0, "2 of 2 records have the same bits\n")
    assert reproduce(folder, "--records", "2") == equal

    def lose_a_shard(content):
        content["state"] = "incomplete"
        lost = {"state": "planned", "sha256": "", "bytes": 0, "n_failed": 0}
        content["shards"][1] |= lost
        content["files"]["config.yaml"] = sha256_file(folder / "config.yaml")

    edit_manifest(folder, lose_a_shard)
    name = "shards/shard-00001.h5"
    (folder / name).unlink()
    assert main(["resume", "--quiet", "--workers", "1", str(folder)]) == 0
    with h5py.File(folder / name) as made, h5py.File(reference / name) as before:
        assert np.array_equal(made["acceleration"], before["acceleration"])


ELSEWHERE = {"cpu_model": "Another CPU"}


@pytest.mark.parametrize(
    ("part", "environment", "status"),
    [(5e-7, {}, 1), (5e-7, ELSEWHERE, 0), (2e-6, ELSEWHERE, 1)],
)
def test_a_difference_is_accepted_only_elsewhere_and_up_to_1e_6(
    reference, tmp_path, reproduce, part, environment, status
):
    """One sample of one record is off by a part of its RMS, as if made elsewhere."""
    folder = shutil.copytree(reference, tmp_path / "data")
    edit_manifest(folder, lambda content: content["environment"].update(environment))
    with h5py.File(folder / "shards" / "shard-00001.h5", "r+") as file:
        signal = file["acceleration"][1, 0]
        index = int(np.argmin(np.abs(signal)))  # where single precision resolves least
        signal[index] += part * np.sqrt(np.mean(np.square(signal, dtype=np.float64)))
        file["acceleration"][1, 0] = signal
    result, said = reproduce(folder)
    assert result == status
    assert "5 of 6 records have the same bits" in said
    assert f"largest difference {part:.2g} of the record's RMS, in r000005" in said
    assert ("made with cpu_model Another CPU" in said) == bool(environment)


@pytest.mark.parametrize(
    ("difference", "n_refused"),
    [(ACCEPTED + 1e-5, 0), (np.nextafter(ACCEPTED + 1e-5, 1.0), 2)],
)
def test_the_limit_itself_is_accepted(
    reference, tmp_path, monkeypatch, difference, n_refused
):
    """One count of stored counts is added to it."""
    folder = shutil.copytree(reference, tmp_path / "data")
    edit_manifest(folder, lambda content: content["environment"].update(ELSEWHERE))
    found = difference, 1e-5
    monkeypatch.setattr(reproduction, "_difference", lambda *_: found)
    assert reproduction.reproduce(folder, 2).n_refused == n_refused


@pytest.mark.parametrize(
    "name", ["tacho", "encoder_angle", "mesh_force", "mesh_pinion_tooth", "noise_power"]
)
def test_all_stored_arrays_are_compared(reference, tmp_path, reproduce, name):
    folder = shutil.copytree(reference, tmp_path / "data")
    with h5py.File(folder / "shards" / "shard-00000.h5", "r+") as file:
        values = file[name][2]
        values.flat[0] += 1
        file[name][2] = values
    result, said = reproduce(folder)
    assert result == 1
    assert "5 of 6 records have the same bits" in said
    assert "in r000002" in said


def test_records_that_failed_are_reported_with_their_reason(
    tmp_path, capsys, reproduce
):
    """Half of the conditions ask for steps that are too long."""
    out = tmp_path / "data"
    values = "{distribution:choice,values:[1,1e6]}"
    vary = f"plan.vary={{operating.drive_frequency_hz:{values}}}"
    words = [*TINY, "dataset.records_per_shard=4", vary, "executor.n_workers=1"]
    failed = re.compile(
        r"(\d) of 6 records failed.*: "
        r"solver.oversampling = \d+ makes internal steps of .* at least \d+"
    )
    assert main(["generate", *words, f"out={out}"]) == 1
    n_failed = int(failed.search(capsys.readouterr().err)[1])
    assert 0 < n_failed < 6
    assert failed.search((out / "run.log").read_text())
    for verb in ("resume", "finalize"):
        assert main([verb, str(out)]) == 1
        assert failed.search(capsys.readouterr().err)
    same = f"{6 - n_failed} of 6 records have the same bits"
    reason = f"{n_failed} failed again for the same reason and hold no signal"
    assert reproduce(out) == (0, f"{same}; {reason}\n")


def read_record(path):
    with h5py.File(path) as file:
        return {name: file[name][0] for name in file if name != "params"}


@pytest.mark.parametrize("noise", ["healthy_twin", "record"])
def test_record_and_twin_differ_by_the_fault_alone(reference, tmp_path, noise, capsys):
    folder = reference
    if noise == "record":
        words = ("sensing.snr_reference=record", "sensing.snr_db=20")
        folder = make(tmp_path / "data", *SET, *words)
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        faulty = file["label_name"].asstr()[:].tolist().index("crack")
        names = ("acceleration", "acceleration_clean", "noise_power")
        stored = {name: file[name][faulty] for name in names}
    words = ["simulate", "--from", str(folder), "--record", str(faulty), "--output"]
    original, healthy = tmp_path / "original.h5", tmp_path / "twin.h5"
    assert main([*words, str(original)]) == 0
    assert main([*words, str(healthy), "--twin"]) == 0
    said = capsys.readouterr().out
    made, twin = read_record(original), read_record(healthy)
    assert f"healthy twin of r{faulty:06d} (crack)\nspeed" in said
    assert f"class crack, severity {made['severity']:.3f}\nspeed" in said
    for name, values in stored.items():
        assert np.array_equal(made[name], values), name
    for name in (
        "unit_id",
        "condition_id",
        "start_tooth_pinion",
        "start_phase",
        "speed_set_rpm",
        "noise_power",
    ):
        assert np.array_equal(twin[name], made[name]), name
    assert made["severity"] > 0.0 == twin["severity"]
    assert twin["faults_json"] == b"[]"
    assert not np.array_equal(twin["acceleration_clean"], made["acceleration_clean"])
    level = np.sqrt(np.mean(np.square(stored["acceleration"], dtype=np.float64)))
    residuals = [made[name].astype(float) - twin[name] for name in names[:2]]
    assert_allclose(*residuals, rtol=0.0, atol=3e-6 * level)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ([], "--record"),
        (["--record", "6"], "0 to 5"),
        (["--record", "1", "seed=3"], "no overrides"),
    ],
)
def test_a_mistake_is_one_line(reference, words, hint, capsys):
    assert main(["simulate", "--from", str(reference), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert hint in line
