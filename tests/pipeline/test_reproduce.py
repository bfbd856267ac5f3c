"""Records made once more from a data set: the same bits, and a twin that differs by the fault alone."""

import json
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml
from small_sets import TINY, make

from gensig.cli import main
from gensig.dynamics.backends.registry import DEFAULT_BACKEND

SET = (
    "dataset.records_per_shard=4", "dataset.store_clean=true", "dataset.store_tacho=true",
    "dataset.store_mesh_state=true", "dataset.store_encoder=true",
)  # fmt: skip


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    vary = "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}"
    return make(tmp_path_factory.mktemp("reference") / "data", *SET, vary)


def reproduce(
    folder: Path, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[int, str]:
    capsys.readouterr()
    return main(["reproduce", str(folder), *words]), capsys.readouterr().out


def test_every_record_has_the_same_bits(
    reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reproduce(reference, capsys) == (0, "6 of 6 records have the same bits\n")
    assert reproduce(reference, capsys, "--records", "2") == (
        0,
        "2 of 2 records have the same bits\n",
    )


def test_a_set_of_the_default_backend_is_stored_as_by_0_9(reference: Path) -> None:
    """Nothing that is stored names the default backend, so that files, identity and shards are those of 0.9.0."""
    texts = [
        (reference / name).read_text() for name in ("config.yaml", "manifest.json")
    ]
    with h5py.File(reference / "shards" / "shard-00000.h5") as file:
        texts.append(str(file.attrs["config_json"]))
    assert all("oversampling" in text and "backend" not in text for text in texts)


def test_a_set_that_names_the_default_backend_goes_on(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The missing key and its default are one configuration: records are the same, and lost shards are made."""
    folder = tmp_path / "data"
    shutil.copytree(reference, folder)
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config["solver"]["backend"] = DEFAULT_BACKEND
    (folder / "config.yaml").write_text(yaml.safe_dump(config, sort_keys=False))
    assert reproduce(folder, capsys, "--records", "2") == (
        0,
        "2 of 2 records have the same bits\n",
    )
    content = json.loads((folder / "manifest.json").read_text())
    content["state"] = "incomplete"
    content["shards"][1] |= {
        "state": "planned",
        "sha256": "",
        "bytes": 0,
        "n_failed": 0,
    }
    (folder / "manifest.json").write_text(json.dumps(content))
    lost = folder / "shards" / "shard-00001.h5"
    lost.unlink()
    assert main(["resume", "--quiet", "--workers", "1", str(folder)]) == 0
    with (
        h5py.File(lost) as made,
        h5py.File(reference / "shards" / "shard-00001.h5") as before,
    ):
        assert np.array_equal(made["acceleration"], before["acceleration"])


def alter(reference: Path, out: Path, part: float, environment: dict[str, str]) -> Path:
    """A copy with one sample of one record off by a part of its RMS, as if made elsewhere."""
    shutil.copytree(reference, out)
    content = json.loads((out / "manifest.json").read_text())
    content["environment"] |= environment
    (out / "manifest.json").write_text(json.dumps(content))
    with h5py.File(out / "shards" / "shard-00001.h5", "r+") as file:
        signal = file["acceleration"][1, 0]
        place = int(np.argmin(np.abs(signal)))  # where single precision resolves least
        signal[place] += part * np.sqrt(np.mean(np.square(signal, dtype=np.float64)))
        file["acceleration"][1, 0] = signal
    return out


ELSEWHERE = {"cpu_model": "Another CPU"}


@pytest.mark.parametrize(
    ("part", "environment", "status"),
    [(5e-7, {}, 1), (5e-7, ELSEWHERE, 0), (2e-6, ELSEWHERE, 1)],
)
def test_a_difference_is_accepted_only_elsewhere_and_up_to_1e_6(
    reference: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    part: float,
    environment: dict,
    status: int,
) -> None:
    folder = alter(reference, tmp_path / "data", part, environment)
    found, said = reproduce(folder, capsys)
    assert found == status
    assert "5 of 6 records have the same bits" in said
    assert f"largest difference {part:.2g} of the record's RMS, in r000005" in said
    assert ("made with cpu_model Another CPU" in said) == bool(environment)


@pytest.mark.parametrize(
    "name", ["tacho", "encoder_angle", "mesh_force", "mesh_pinion_tooth", "noise_power"]
)
def test_all_that_is_stored_is_compared(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    folder = alter(reference, tmp_path / "data", 0.0, {})
    with h5py.File(folder / "shards" / "shard-00000.h5", "r+") as file:
        values = file[name][2]
        values.flat[0] += 1
        file[name][2] = values
    found, said = reproduce(folder, capsys)
    assert found == 1
    assert "5 of 6 records have the same bits" in said
    assert "in r000002" in said


def test_records_that_failed_are_told_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half of the conditions ask for steps that are too long; all that says so names the reason."""
    out = tmp_path / "data"
    vary = (
        "plan.vary={operating.drive_frequency_hz:{distribution:choice,values:[1,1e6]}}"
    )
    words = [
        "generate",
        *TINY,
        "dataset.records_per_shard=4",
        vary,
        "executor.n_workers=1",
        f"out={out}",
    ]
    failed = r"(\d) of 6 records failed.*: solver.oversampling = 5 makes internal steps of .* at least \d+"
    assert main(words) == 1
    found = re.search(failed, capsys.readouterr().err)
    assert found is not None
    n_failed = int(found[1])
    assert 0 < n_failed < 6
    assert re.search(failed, (out / "run.log").read_text())
    for verb in ("resume", "finalize"):
        assert main([verb, str(out)]) == 1
        assert re.search(failed, capsys.readouterr().err)
    again = f"{6 - n_failed} of 6 records have the same bits; {n_failed} failed again for the same reason"
    assert reproduce(out, capsys) == (0, f"{again} and hold no signal\n")


def read_one(path: Path) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        return {
            name: file[name][0] for name in file if isinstance(file[name], h5py.Dataset)
        }


@pytest.mark.parametrize("noise", ["healthy_twin", "record"])
def test_record_and_twin_differ_by_the_fault_alone(
    reference: Path, tmp_path: Path, noise: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = reference
    if noise == "record":
        folder = make(
            tmp_path / "data", *SET, "sensing.snr_reference=record", "sensing.snr_db=20"
        )
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        faulty = int(np.flatnonzero(file["label_name"].asstr()[:] == "crack")[0])
        stored = {
            name: file[name][faulty]
            for name in ("acceleration", "acceleration_clean", "noise_power")
        }
    words = ["simulate", "--from", str(folder), "--record", str(faulty), "--output"]
    assert main([*words, str(tmp_path / "again.h5")]) == 0
    assert main([*words, str(tmp_path / "twin.h5"), "--twin"]) == 0
    said = capsys.readouterr().out
    assert f"healthy twin of r{faulty:06d} (crack)\nspeed" in said
    assert (
        f"class crack, severity {read_one(tmp_path / 'again.h5')['severity']:.3f}\nspeed"
        in said
    )
    again, twin = read_one(tmp_path / "again.h5"), read_one(tmp_path / "twin.h5")
    for name, values in stored.items():
        assert np.array_equal(again[name], values), name
    for name in (
        "unit_id",
        "condition_id",
        "start_tooth_pinion",
        "start_phase",
        "speed_set_rpm",
        "noise_power",
    ):
        assert np.array_equal(twin[name], again[name]), name
    assert again["severity"] > 0.0
    assert twin["severity"] == 0.0
    assert twin["faults_json"] == b"[]"
    assert not np.array_equal(twin["acceleration_clean"], again["acceleration_clean"])
    level = np.sqrt(np.mean(np.square(stored["acceleration"], dtype=np.float64)))
    residuals = [
        again[name].astype(float) - twin[name]
        for name in ("acceleration", "acceleration_clean")
    ]
    np.testing.assert_allclose(*residuals, rtol=0.0, atol=3e-6 * level)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--from", "@"], "--record"),
        (["--from", "@", "--record", "6"], "0 to 5"),
        (["--from", "@", "--record", "1", "seed=3"], "no overrides"),
        (["--twin"], "--from DIR"),
    ],
)
def test_a_mistake_is_one_line(
    reference: Path, words: list[str], hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(["simulate", *(word.replace("@", str(reference)) for word in words)]) == 2
    )
    (line,) = capsys.readouterr().err.splitlines()
    assert hint in line
