"""Plan tables: exact round trip through CSV, and refusals in one line."""

import pickle
import tempfile
from pathlib import Path

import numpy as np
import pytest
from dataset_samples import make_plan
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dataset.plan import (
    Plan,
    PlanRows,
    plan_text,
    read_plan,
    record_ids,
    shard_rows,
)
from gensig.errors import DatasetError


def _plan(**columns):
    n = len(next(iter(columns.values())))
    shard, row = shard_rows(n, 3)
    return Plan(
        columns={"record_id": record_ids(n), "shard": shard, "row": row, **columns}
    )


def _same(a, b):
    assert list(a.columns) == list(b.columns)
    for name, values in a.columns.items():
        other = b.columns[name]
        assert values.dtype.kind == other.dtype.kind
        assert_array_equal(values, other)
        if values.dtype.kind == "f":
            assert_array_equal(np.signbit(values), np.signbit(other))


TEXT = st.text(st.characters(blacklist_categories=("Cc", "Cs")), max_size=8)


@settings(max_examples=40, deadline=None)
@given(
    floats=st.lists(st.floats(), min_size=1, max_size=6),
    integer=st.integers(-(2**63), 2**63 - 1),
    text=TEXT,
)
def test_round_trip_is_exact(floats, integer, text):
    n = len(floats)
    columns = {"depth_mm": floats, "count": [integer] * n, "unit_id": [text] * n}
    plan = _plan(**columns)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "plan.csv").write_text(plan_text(plan))
        _same(plan, read_plan(Path(folder) / "plan.csv"))


@settings(max_examples=40, deadline=None)
@given(
    texts=st.lists(TEXT, min_size=1, max_size=7),
    depth=st.floats(),
    data=st.data(),
)
def test_some_rows_are_those_of_the_whole(texts, depth, data):
    """Line separators that are no control characters (U+2028, U+0085 is one) belong to the text."""
    n = len(texts)
    columns = {"unit_id": texts, "params/depth_mm": [depth] * n, "label": range(n)}
    plan = _plan(**{name: np.array(values) for name, values in columns.items()})
    first = data.draw(st.integers(0, n - 1))
    n_records = data.draw(st.integers(1, n - first))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "plan.csv").write_text(plan_text(plan))
        rows = PlanRows(Path(folder) / "plan.csv")
        assert rows.names == list(plan.columns)
        result = rows.records(first, n_records)
    assert repr(result) == repr([plan.record(first + k) for k in range(n_records)])


@pytest.fixture
def four(tmp_path):
    """The file of a plan of four records."""
    path = tmp_path / "plan.csv"
    path.write_text(plan_text(_plan(label=np.arange(4))))
    return path


@pytest.mark.parametrize(("first", "n_records"), [(0, 0), (2, 3), (4, 1)])
def test_rows_that_are_not_there_are_refused(four, first, n_records):
    with refused("has no records", DatasetError):
        PlanRows(four).records(first, n_records)


def test_a_damaged_row_is_refused(four):
    lines = four.read_text().splitlines()
    lines[3] = lines[3].rpartition(",")[0]
    four.write_text("\n".join(lines) + "\n")
    rows = PlanRows(four)
    assert len(rows.records(0, 2)) == 2
    with refused("cut or damaged near record 2", DatasetError):
        rows.records(2, 1)
    with refused("cannot be read", DatasetError):
        PlanRows(four.with_name("no.csv"))


def test_values_look_as_promised():
    columns = {"a": [0.1, 1.0], "b": [3, -4], "c": ["x", 'say "y", z']}
    text = plan_text(
        _plan(**{key: np.array(values) for key, values in columns.items()})
    )
    rows = 'r000000,0,0,0.1,3,x\nr000001,0,1,1.0,-4,"say ""y"", z"\n'
    assert text == f"record_id,shard,row,a,b,c\n{rows}"


def test_text_that_would_come_back_as_numbers_is_refused():
    assert "7" in plan_text(
        _plan(unit_id=np.array(["7", "8"]))
    )  # known to the schema as text
    with refused("look like numbers", DatasetError):
        plan_text(_plan(house=np.array(["7", "8"])))


def test_plan_is_immutable_and_pickles():
    values = np.array([1.0, 2.0])
    plan = _plan(a=values)
    values[0] = 9.0  # the caller's array stays the caller's
    assert plan.columns["a"][0] == pytest.approx(1.0)
    with pytest.raises(ValueError, match="read-only"):
        plan.columns["a"][0] = 3.0
    with pytest.raises(TypeError):
        plan.columns["b"] = values  # type: ignore[index]
    _same(plan, pickle.loads(pickle.dumps(plan)))


def test_rows_of_shards():
    plan = make_plan()
    assert plan.n_records == 36
    assert plan.n_shards == 4
    assert plan.shard_sizes() == [10, 10, 10, 6]
    assert plan.rows(3).tolist() == [30, 31, 32, 33, 34, 35]
    with refused("shards 0 to 3", DatasetError):
        plan.rows(4)


@pytest.mark.parametrize(
    "changes",
    [
        {"record_id": ["a", "a"]},
        {"record_id": ["a", "../b"]},
        {"record_id": ["a"]},
        {"shard": [0, 2], "row": [0, 0]},
        {"shard": [1, 0], "row": [0, 0]},
        {"row": [1, 0]},
        {"row": [[0], [1]]},
        {"record_id": [], "shard": [], "row": []},
        {"x": [1j, 1j]},
        {"x": ["a\nb", ""]},
    ],
)
def test_impossible_plan_is_refused(changes):
    columns = {"record_id": ["a", "b"], "shard": [0, 0], "row": [0, 1]}
    Plan(columns=columns)
    with pytest.raises(DatasetError):
        Plan(columns=columns | changes)


def test_a_plan_needs_its_columns():
    with refused("no column row; every plan needs", DatasetError):
        Plan(columns={"record_id": ["a"], "shard": [0]})


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("r000001,0,1", "r000001,0"),
        ("r000001,0,1", "r000001,0,x"),
        ("r000001,0,1", "r000000,0,1"),
        ("r000001,0,1", "r000001,0,99999999999999999999"),
        ("record_id,shard,row", "record_id,shard,shard"),
        ("record_id,shard", "name,shard"),
        ("r000001", '"r000001'),
    ],
)
def test_malformed_file_is_refused_in_one_line(tmp_path, old, new):
    path = tmp_path / "plan.csv"
    text = plan_text(_plan(a=np.array([0.5, 1.5])))
    path.write_text(text)
    read_plan(path)
    for content in (text.replace(old, new).encode(), b"", b"\xff\xfe\x00", b"a\x00b\n"):
        path.write_bytes(content)
        with refused("plan.csv", DatasetError):
            read_plan(path)
