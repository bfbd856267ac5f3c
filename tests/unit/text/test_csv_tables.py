"""No cell of a written table is a formula, and every text comes back."""

import csv
import io

import numpy as np
import pytest

from gensig.dataset.plan import Plan, PlanRows, plan_text, read_plan
from gensig.dataset.splitting.splits import SplitTable, read_split
from gensig.text.csv_tables import (
    guarded_cell,
    header_line,
    plain_cell,
    read_records,
    read_rows,
    write_records,
    write_rows,
)

FORMULAS = [
    "=cmd|' /C calc'!A0",
    "+1+cmd|'x'!A0",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    "\uff1d1+1",
    "-",
    "=",
    "-crack",
]
HARMLESS = [
    "",
    "crack",
    "-1.5",
    "+3e-4",
    "-inf",
    "nan",
    "-12.3 %",
    "a=b",
    "'quoted'",
    "'",
    "1-2",
]
MARKED = [f"{marks}{text}" for marks in ("'", "''") for text in (*FORMULAS, *HARMLESS)]


@pytest.mark.parametrize("text", FORMULAS)
def test_a_text_that_a_spreadsheet_runs_gets_an_apostrophe(text):
    assert guarded_cell(text) == f"'{text}"


@pytest.mark.parametrize("value", [*HARMLESS, -1.5, -3, None, True])
def test_numbers_and_harmless_texts_stay(value):
    assert guarded_cell(value) is value


def test_every_text_comes_back_and_no_two_are_written_alike():
    texts = [*FORMULAS, *HARMLESS, *MARKED]
    written = [guarded_cell(text) for text in texts]
    assert [plain_cell(text) for text in written] == texts
    assert len(set(written)) == len(set(texts))


def test_rows_and_records_come_back():
    file = io.StringIO(newline="")
    write_rows(file, [["name", "=head"], ["=a,b", "-1"], ["'=c", "x\ny"]])
    text = file.getvalue()
    assert next(csv.reader(io.StringIO(text, newline=""))) == ["name", "'=head"]
    rows = list(read_rows(io.StringIO(text, newline="")))
    assert rows == [["name", "=head"], ["=a,b", "-1"], ["'=c", "x\ny"]]
    file = io.StringIO(newline="")
    write_records(file, ["a", "b"], [{"b": "@x", "a": 1}, {"a": 2}])
    assert file.getvalue() == "a,b\n1,'@x\n2,\n"
    records = list(read_records(io.StringIO(file.getvalue(), newline="")))
    assert records == [{"a": "1", "b": "@x"}, {"a": "2", "b": ""}]
    with pytest.raises(ValueError, match="no column for c"):
        write_records(file, ["a"], [{"c": 1}])


def test_a_header_of_numbers_is_quoted_too():
    assert header_line(["time_s", "=x", "a,b"]) == 'time_s,\'=x,"a,b"'


@pytest.mark.parametrize("unit", ["=unit", "-", "'=unit", "plain"])
def test_plans_and_splits_keep_hostile_names(tmp_path, unit):
    rows = {"record_id": ["r0", "r1"], "shard": [0, 0], "row": [0, 1]}
    plan = Plan(columns={**rows, "unit_id": [unit, "b"]})
    (tmp_path / "plan.csv").write_text(plan_text(plan), encoding="utf-8", newline="")
    assert read_plan(tmp_path / "plan.csv").columns["unit_id"].tolist() == [unit, "b"]
    assert PlanRows(tmp_path / "plan.csv").records(0, 1)[0]["unit_id"] == unit
    table = SplitTable(
        record_id=np.array([unit, "b"]),
        start_fraction=np.zeros(2),
        stop_fraction=np.ones(2),
        subset=np.array(["train", "test"]),
    )
    (tmp_path / "split.csv").write_text(table.to_csv(), encoding="utf-8", newline="")
    assert read_split(tmp_path / "split.csv").record_id.tolist() == [unit, "b"]
