"""Data cards, read by the Croissant validator, by Hugging Face and by people."""

import datetime
import json
from types import SimpleNamespace

import mlcroissant
import numpy as np
import pytest
import yaml
from dataset_samples import CLASSES, build, make_plan
from numpy.testing import assert_allclose

from gensig.dataset.cards.card import card_text, class_rows, front_matter
from gensig.dataset.cards.croissant import _meaning
from gensig.dataset.columns import COLUMNS
from gensig.dataset.reader import open_dataset
from gensig.dataset.storage.atomic import sha256_file


def croissant(folder):
    return json.loads((folder / "croissant.json").read_text(encoding="utf-8"))


def _front(text):
    first, matter, _rest = text.split("---\n", 2)
    assert first == ""
    return yaml.safe_load(matter)


def test_front_matter(folder):
    front = _front((folder / "README.md").read_text(encoding="utf-8"))
    assert front["license"] == "cc-by-4.0"
    assert front["size_categories"] == ["n<1K"]
    assert {"synthetic", "vibration", "gensig-0.1.0"} <= set(front["tags"])
    assert front["configs"][0]["data_files"] == [
        {"split": "train", "path": "shards/*.h5"}
    ]


@pytest.mark.parametrize(
    ("n_records", "expected"), [(999, "n<1K"), (1000, "1K<n<10K"), (10**7, "n>10M")]
)
def test_size_category(data, n_records, expected):
    data.n_records = n_records
    assert _front(front_matter(data) + "\n")["size_categories"] == [expected]


def test_classes_are_listed_in_their_order_with_those_that_have_records():
    names = np.array(["wear", "healthy", "wear", "healthy", "odd", "crack"])
    columns = {"label_name": names, "severity": np.arange(6.0)}
    data = SimpleNamespace(
        class_names=["wear", "healthy", "crack", "pitting"],
        is_reference=np.arange(6) == 5,
        column=columns.get,
    )
    assert class_rows(data) == [
        ("wear", 2, "0 to 2"),
        ("healthy", 2, "1 to 3"),
        ("odd", 1, "4"),
    ]


def test_hostile_names_stay_text(tmp_path, plan):
    """A folder's name cannot add keys to the front matter or tags to the page."""
    folder = build(tmp_path / "a: [b]\nlicense: mine <b>", plan)
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert _front(text)["license"] == "cc-by-4.0"
    assert _front(text)["pretty_name"] == "a: [b] license: mine <b>"
    assert "<b>" not in text.split("---\n", 2)[2]
    assert croissant(folder)["name"] == "a: [b] license: mine <b>"


def test_croissant_is_valid_and_gives_the_records(folder, plan):
    dataset = mlcroissant.Dataset(jsonld=folder / "croissant.json")  # raises on errors
    assert not dataset.metadata.ctx.issues.errors
    assert not dataset.metadata.ctx.issues.warnings
    rows = list(dataset.records("records"))
    assert [row["records/record_id"] for row in rows] == [
        name.encode() for name in plan.columns["record_id"].tolist()
    ]
    assert [row["records/label"] for row in rows] == plan.columns["label"].tolist()
    depths = np.array(
        [row["records/params.crack_depth_mm"] for row in rows], dtype=float
    )
    assert_allclose(depths, plan.columns["params/crack_depth_mm"], rtol=1e-12, atol=0)


def test_a_column_has_its_meaning_and_its_unit_if_it_has_one():
    units = {column.unit for column in COLUMNS.values()}
    assert {"", "1", "N m"} <= units
    for name, column in COLUMNS.items():
        expected = column.description
        if column.unit not in ("", "1"):
            expected = f"{column.description} ({column.unit})"
        assert _meaning(name) == expected


def test_the_validator_would_find_a_mistake(folder):
    content = croissant(folder)
    content["recordSet"][0]["field"][0]["source"]["fileObject"]["@id"] = "nowhere.csv"
    (folder / "croissant.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(mlcroissant.ValidationError):
        mlcroissant.Dataset(jsonld=folder / "croissant.json")


def test_croissant_is_read_line_by_line(folder):
    """A change of one value is one changed line, as in a review of a card."""
    lines = (folder / "croissant.json").read_text(encoding="utf-8").splitlines()
    assert any(line.startswith(' "name": ') for line in lines)


def test_croissant_lists_every_file_with_its_digest(folder):
    content = croissant(folder)
    listed = {item["contentUrl"]: item["sha256"] for item in content["distribution"]}
    assert {f"shards/shard-0000{i}.h5" for i in range(4)} | {
        "plan.csv",
        "splits/by_unit.csv",
    } <= set(listed)
    assert all(sha256_file(folder / name) == digest for name, digest in listed.items())


def test_responsible_ai_fields_state_facts_and_caveats(tmp_path):
    folder = build(tmp_path / "a", make_plan(), failed=12)
    content = croissant(folder)
    for field in (
        "dataCollection",
        "dataLimitations",
        "dataBiases",
        "dataUseCases",
        "personalSensitiveInformation",
        "dataSocialImpact",
        "dataAnnotationProtocol",
        "dataReleaseMaintenancePlan",
    ):
        assert content[f"rai:{field}"], field
    assert "crack 12, healthy 12, pitting 12" in content["rai:dataBiases"][0]
    assert "1 records failed" in content["rai:dataBiases"][2]
    assert any(
        "proved nothing about measured signals" in line
        for line in content["rai:dataLimitations"]
    )
    assert all(name in content["description"] for name in CLASSES)
    metadata = mlcroissant.Dataset(jsonld=folder / "croissant.json").metadata
    assert metadata.data_limitations is not None


def test_it_is_published_on_the_day_it_was_made(folder):
    content = croissant(folder)
    with open_dataset(folder) as data:
        made = data.manifest.environment["created"]
    day = datetime.date.fromisoformat(content["datePublished"])
    assert day == datetime.datetime.fromisoformat(made).date()


def test_card_is_the_text_written(folder):
    with open_dataset(folder) as data:
        assert card_text(data) == (folder / "README.md").read_text(encoding="utf-8")
