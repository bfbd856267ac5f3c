"""Advice on several values, lists and words that the shell took apart: what it says works."""

import re

import pytest
from refusals import refused

from gensig.options.compose import override_keys, sweep
from gensig.options.shell_words import unquoted
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

SIZE = ("plan.n_records=12", "plan.n_units=4")


def advised(words):
    """Message on words that cannot be used, and the quoted words that it advises."""
    with pytest.raises(Exception, match=r"\S") as caught:
        override_keys(words)
    text = str(caught.value)
    assert "\n" not in text
    return text, re.findall(r"'([^']+=[^']*)'", text)


@pytest.mark.parametrize(
    ("word", "column", "values"),
    [
        (f"{key}={typed}", key, values)
        for key, values in (
            ("operating.torque_nm", {20.0, 40.0, 55.0}),
            ("sensing.snr_db", {10.0, 15.5}),
        )
        for typed in (
            ",".join(map("{:g}".format, sorted(values))),
            f"[{','.join(map('{:g}'.format, sorted(values)))}]",
        )
    ],
)
def test_the_advised_words_make_a_plan_with_these_values(word, column, values):
    (advice,) = advised([word])[1]
    plan = make_plan(read_request([advice, *SIZE]).config)
    assert set(plan.columns[f"params/{column}"]) == values


@pytest.mark.parametrize("typed", ["1,1.5", "[1,1.5]"])
def test_values_of_a_fault_are_drawn_by_its_own_vary(typed):
    words = ["fault=crack", f"fault.crack_depth_mm={typed}"]
    (advice,) = advised(words)[1]
    assert advice.startswith("fault.vary={crack_depth_mm:")
    plan = make_plan(read_request(["fault=crack", advice, *SIZE]).config)
    assert set(plan.columns["params/fault.crack_depth_mm"]) == {1.0, 1.5}


def test_a_list_of_faults_is_a_class_each_or_one_compound_fault():
    text, (classes, parts) = advised(["fault=[crack,pitting]"])
    assert "fault=compound" in text
    assert read_request([classes]).config["plan"]["classes"] == ["crack", "pitting"]
    whole = read_request(["fault=compound", parts]).config["fault"]
    assert [part["kind"] for part in whole["parts"]] == ["crack", "pitting"]
    assert classes in advised(["fault=crack,pitting"])[1]
    (named,) = advised(["fault=glob(c*)"])[1]
    assert named == "plan.classes=[chipped,compound,crack]"


def test_an_interval_is_drawn_from_or_stepped_through():
    words = ["operating.torque_nm=interval(20,40)"]
    text, (advice,) = advised(words)
    drawn = make_plan(read_request([advice, *SIZE]).config)
    torques = drawn.columns["params/operating.torque_nm"]
    assert 20.0 <= min(torques) < 25.0
    assert 35.0 < max(torques) <= 40.0
    assert "range(20,40,STEP)" in text
    with refused("an interval has no end of values"):
        sweep(words)


@pytest.mark.parametrize(
    ("word", "absent"),
    [
        ("mesh.law=paper,one_sided", "type '"),
        ("gear=xiamen_23_84,harbin_38_55", "type '"),
        ("seed=1,2", "plan.vary"),
        ("operating.duration_s=range(1,3)", "plan.vary"),
        ("operating.duration_s=[3,4]", "plan.vary"),
    ],
)
def test_what_is_one_for_a_data_set_is_not_to_be_drawn(word, absent):
    text, _ = advised([word])
    assert absent not in text
    assert "gensig generate -m makes one data set for each" in text


def test_many_values_are_not_listed_and_none_are_refused():
    text, advice = advised(["operating.torque_nm=range(1,1000000000)"])
    assert advice == []
    assert len(text) < 200
    with refused("seed=range(1,3,0): range() arg 3 must not be zero"):
        override_keys(["seed=range(1,3,0)"])


def test_keys_of_a_training_are_told_of_its_own_command():
    for word in ("epochs=3,4", "learning_rate=0.1,0.2", "model=cnn,order"):
        text, advice = advised([word])
        assert text.endswith("diagnose train -m makes one run for each")
        assert advice == []
    words = ["model=cnn", "model.n_channels=16,32"]
    assert "plan.vary" not in advised(words)[0]
    assert advised(["classes=healthy,crack"])[1] == ["classes=[healthy,crack]"]
    assert advised(["experiment=quickstart,helical"])[1] == []


def test_a_list_stays_a_list_where_one_is_right():
    words = ["sensing.channels=[pinion_x]", "plan.classes=[crack]", "fault.tooth=[1,2]"]
    keys = ["sensing.channels", "plan.classes", "fault.tooth"]
    assert list(override_keys(words)) == keys


@pytest.mark.parametrize(
    ("words", "quoted"),
    [
        (
            ["plan.classes=[healthy,", "crack]", "seed=1"],
            "'plan.classes=[healthy, crack]'",
        ),
        (["seed=1", "plan.vary={a:", "{b:", "1}}"], "'plan.vary={a: {b: 1}}'"),
        (["plan.vary=a:1", "plan.vary=b:2"], "'plan.vary={...}'"),
        (
            ["plan.vary={a:distribution:uniform}", "plan.vary={a:low:3}"],
            "'plan.vary={...}'",
        ),
        (["fault.parts=[kind:crack]", "fault.parts=[tooth:3]"], "'fault.parts={...}'"),
    ],
)
def test_words_that_the_shell_took_apart_are_to_be_quoted(words, quoted):
    with refused("quote"):
        override_keys(words)
    assert quoted in str(unquoted(words))


@pytest.mark.parametrize(
    "words",
    [
        ["plan.vary={a: {low: 1}}", "plan.vary={b: {low: 2}}"],
        ["seed=1", "seed=2"],
        ["executor.address=tcp://a:1", "executor.address=tcp://b:2"],
        ["plan.classes=[a,b]", "out=a"],
    ],
)
def test_whole_words_need_no_quotes(words):
    assert unquoted(words) is None


def test_glob_stands_for_the_options_that_match(tmp_path):
    (tmp_path / "fault").mkdir()
    (tmp_path / "fault" / "crooked.yaml").write_text("# Mine.\nkind: crack\n")
    packaged = ["fault=chipped", "fault=compound", "fault=crack"]
    assert [job[0] for job in sweep(["fault=glob(c*)"])] == packaged
    jobs = sweep(["fault=glob([c*],exclude=comp*)"], config_dir=tmp_path)
    names = ["chipped", "crack", "crooked"]
    assert [job[0] for job in jobs] == [f"fault={name}" for name in names]
    with refused("fault=glob(q*) matches no option; there is broken"):
        sweep(["fault=glob(q*)"])
    with refused("'seed' is none"):
        sweep(["seed=glob(1*)"])
    with refused("seed=range(1,3,0)"):
        sweep(["seed=range(1,3,0)"])
