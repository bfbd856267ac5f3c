"""docs/format.md is the contract: it says what the code does."""

import re
from pathlib import Path

import h5py
import pytest
from dataset_samples import build, row_of
from numpy.testing import assert_allclose

from gensig.dataset.columns import (
    COLUMNS,
    GEAR_COLUMNS,
    IS_REFERENCE,
    LIFE_COLUMNS,
    Column,
)
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.reader import open_dataset
from gensig.dataset.schema import (
    READABLE_VERSIONS,
    REQUIRED,
    REQUIRED_ATTRIBUTES,
    SAMPLE_TYPES,
    SCALES,
    SIGNALS,
)
from gensig.errors import DatasetError

TEXT = (Path(__file__).parents[3] / "docs" / "format.md").read_text(encoding="utf-8")


def test_every_data_set_is_described_in_a_row_of_its_own():
    """The rows between the two comments are those of the tables, in their order."""
    rows = []
    for column in (*SIGNALS.values(), *COLUMNS.values()):
        kind = f"ASCII, {column.n_bytes} bytes" if column.is_text else column.dtype
        if column.name in SCALES:
            kind = " or ".join(SAMPLE_TYPES)
        name = f"`{column.name}`{' *' * (column.name in REQUIRED)}"
        if column.axes:
            kind = f"({', '.join(('record', *column.axes))}) {kind}"
        if column.unit not in ("", "1"):
            kind += f", {column.unit}"
        cells = (name, kind, column.role, column.description)
        rows.append(f"| {' | '.join(cells)} |")
    result = re.search(
        r"<!-- columns:.*?-->\n.*?\n.*?\n(.*)\n.*?\n<!-- end", TEXT, re.DOTALL
    )
    assert result[1].splitlines() == rows
    known = " and ".join(map(str, READABLE_VERSIONS))
    assert f"versions {known}\n" in TEXT.splitlines(keepends=True)[0]


def test_attributes_keys_and_protocols_are_named(folder):
    with open_dataset(folder) as data:
        assert all(
            f"`{name}`" in TEXT
            for name in (*REQUIRED_ATTRIBUTES, *data.attributes, *data.protocols)
        )
    assert all(f"`{name}`" in TEXT for name in read_manifest(folder).__slots__)


def test_shards_are_as_described(folder):
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        for name, column in COLUMNS.items():
            is_optional = name in (*LIFE_COLUMNS, *GEAR_COLUMNS, IS_REFERENCE)
            assert (name in file) == (not is_optional)
            assert is_optional or file[name].dtype == column.storage_dtype
        for name in REQUIRED:
            assert file[name].shape[0] == 10
        assert h5py.check_string_dtype(file["record_id"].dtype).encoding == "ascii"


@pytest.mark.parametrize(("sample_type", "error"), [("float32", 0), ("int16", 1e-4)])
@pytest.mark.parametrize("library", ["h5py", "gensig"])
def test_python_examples_run(tmp_path, plan, library, sample_type, error):
    folder = build(tmp_path / "set", plan, sample_type=sample_type)
    examples = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    (code,) = [example for example in examples if f"import {library}\n" in example]
    names = {}
    exec(code.replace("DIR", str(folder)), names)
    expected = row_of(plan, 0)[0]["acceleration"][: len(names["signal"])]
    assert_allclose(names["signal"], expected, rtol=0, atol=error)


def test_role_must_be_known():
    assert {column.role for column in (*COLUMNS.values(), *SIGNALS.values())} >= {
        "id",
        "label",
        "fault",
        "unit",
    }
    with pytest.raises(DatasetError, match="allowed are"):
        Column(name="x", dtype="int8", unit="", role="secret", description="")
