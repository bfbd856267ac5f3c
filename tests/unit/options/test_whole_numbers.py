"""Counts typed with a point or an exponent are read; numbers that are not whole are refused."""

import pytest
from refusals import refused

from gensig.cli import verb_parser
from gensig.execution.registry import read_executor
from gensig.options.compose import compose
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.text.amounts import typed_count

SHORT = "operating.duration_s=0.02"


@pytest.mark.parametrize(
    ("text", "number"),
    [("1e3", 1000), ("1000.0", 1000), ("1.5e1", 15), ("-2.", -2), ("1e-0", 1)]
    + [(text, None) for text in ("12", "1.5e0", "1e-3", "1e300", "0x10", "", "1,2")],
)
def test_a_text_is_a_count_or_none(text, number):
    assert typed_count(text) == number


@pytest.mark.parametrize("typed", ["2.4e1", "24.0", "24"])
def test_a_plan_of_a_count_is_that_of_its_digits(typed):
    request = read_request([f"plan.n_records={typed}", "plan.n_gearboxes=2e0", SHORT])
    assert type(request.config["plan"]["n_records"]) is int
    assert request.config["plan"]["n_gearboxes"] == 2
    digits = read_request(["plan.n_records=24", "plan.n_gearboxes=2", SHORT])
    assert request.config == digits.config


def planned(word):
    config = read_request([word, SHORT]).config
    read_executor(config["executor"])
    return make_plan(config)


@pytest.mark.parametrize("key", ["plan.n_records", "seed", "executor.n_workers"])
def test_a_number_that_is_not_whole_is_refused(key):
    with refused("1.5"):
        planned(f"{key}=1.5e0")


def test_a_quantity_keeps_what_is_typed():
    assert (
        type(compose("generate", ["operating.torque_nm=2e1"])["operating"]["torque_nm"])
        is float
    )


def test_flags_take_them_too():
    parser = verb_parser("generate")
    assert parser.parse_args(["--workers", "1e1"]).workers == 10
    with refused("--workers 1.5e0 is not a whole number"):
        parser.parse_args(["--workers", "1.5e0"])
