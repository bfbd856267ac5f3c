"""Records of a number of turns, and one random walk for each condition."""

import math

import pytest
from refusals import refused

from gensig.plan.condition_courses import SEED_KEY
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.systems.registry import read_system

RATE = 51200.0
OF_THE_WHEEL = 10 / 30 * 84 / 23
WALK = "operating.speed_profile={kind: random_walk, scatter: 0.01, correlation_time_s: 0.5}"


def config(*words):
    return read_request(list(words)).config


@pytest.fixture
def speeds(tmp_path):
    """The override that takes the speed from a file."""
    file = tmp_path / "speed.csv"
    file.write_text("time_s,speed_rpm\n0,600\n2,1200\n")
    return f"operating.speed_profile={{kind: file, file: '{file}'}}"


def samples(seconds):
    return math.ceil(seconds * RATE - 1e-6) / RATE


class TestTurns:
    @pytest.mark.parametrize(
        ("words", "seconds"),
        [
            ("operating.turns_of=pinion", 10 / 30),
            ("operating.turns_of=wheel", OF_THE_WHEEL),
            ("fault=healthy", 10 / 30),  # no gear is faulted
            ("fault=crack", 10 / 30),
            ("fault=crack fault.gear=wheel", OF_THE_WHEEL),
            ("plan.classes=[healthy,crack]", 10 / 30),
            ("plan.classes=[healthy,crack,pitting] fault.gear=wheel", OF_THE_WHEEL),
            (
                "fault=compound fault.parts=[{kind:crack},{kind:wear,gear:wheel}]",
                OF_THE_WHEEL,
            ),
            (
                "experiment=quickstart",
                10 / 20 * 84 / 23,
            ),  # the wheel may have the fault
            ("experiment=quickstart operating.speed_rpm=600", 84 / 23),
            (
                "plan.vary={operating.speed_rpm:{distribution:choice,values:[1800,900]}}",
                10 / 15,
            ),
            ("operating.speed_profile=[[0,1.2],[1,0.5]]", 10 / 15),
            (
                "operating.speed_profile={kind:ramp,first_factor:0.25,last_factor:1}",
                10 / 7.5,
            ),
            (
                "operating.speed_profile={kind:random_walk,scatter:0.05,correlation_time_s:1}",
                10 / 24,
            ),
            ("operating.speed_ripple={share:0.2,order:1}", 10 / 24),
        ],
    )
    def test_at_the_slowest_speed(self, words, seconds):
        result = config("operating.turns=10", *words.split())
        duration = result["operating"]["duration_s"]
        assert duration == pytest.approx(samples(seconds), rel=1e-12)
        assert read_system(result).operating.duration == duration

    def test_a_file_is_as_slow_as_its_slowest(self, speeds):
        result = config("operating.turns=10", speeds)["operating"]["duration_s"]
        assert result == pytest.approx(1.0, rel=1e-12)

    def test_without_turns_the_duration_is_the_typed_one(self):
        assert config("operating.duration_s=0.3")["operating"]["duration_s"] == 0.3

    @pytest.mark.parametrize(
        ("words", "text"),
        [
            ("operating.duration_s=1", "are both given; leave one out"),
            (
                "plan.vary={operating.speed_ripple.share:{distribution:uniform,low:0,high:0.1}} "
                "operating.speed_ripple={share:0,order:1}",
                "operating.turns: the plan draws operating.speed_ripple.share, so the slowest turn "
                "is not known",
            ),
            (
                "plan.vary={operating.speed_rpm:{distribution:uniform,low:0,high:100}}",
                "operating.turns: the slowest speed of the plan must be positive",
            ),
            (
                "plan.vary={operating.speed_rpm:{distribution:uniform,low:5}}",
                "uniform needs exactly low, high",
            ),
            (
                "operating.speed_profile=[[0,1],[1,0]]",
                "the slowest speed of the plan must be positive",
            ),
        ],
    )
    def test_refusals(self, words, text):
        with refused(text):
            config("operating.turns=10", *words.split())


class TestWalks:
    def test_each_condition_has_its_own_and_all_its_classes_share_it(self):
        counts = ("plan.n_records=18", "plan.n_units=3")
        plan = make_plan(config(WALK, "plan.classes=[healthy,crack,pitting]", *counts))
        names = ("condition_id", f"params/{SEED_KEY}")
        pairs = set(zip(*(plan.columns[name].tolist() for name in names), strict=True))
        conditions, seeds = map(set, zip(*pairs, strict=True))
        assert len(pairs) == len(conditions) == len(seeds) == 6

    def test_also_in_a_grid(self):
        speeds = "plan.vary={operating.speed_rpm: {distribution: choice, values: [1200, 1800]}}"
        counts = ("plan.design=grid", "plan.n_records=null", "plan.n_units=3")
        plan = make_plan(config(WALK, *counts, speeds))
        assert len(set(plan.columns[f"params/{SEED_KEY}"])) == 6

    def test_a_typed_seed_or_distribution_stays(self):
        assert SEED_KEY not in config(WALK, f"{SEED_KEY}=3")["plan"]["vary"]
        own = f"plan.vary={{{SEED_KEY}: {{distribution: choice, values: [1, 2]}}}}"
        assert config(WALK, own)["plan"]["vary"][SEED_KEY] == {
            "distribution": "choice",
            "values": [1, 2],
        }

    def test_without_a_walk_there_is_none(self):
        assert SEED_KEY not in config("operating=ramp")["plan"]["vary"]
        assert (
            SEED_KEY
            in config("operating=drifting", "experiment=quickstart")["plan"]["vary"]
        )

    def test_absolute_files_do_not_go_with_varied_set_points(self, speeds):
        words = ["experiment=quickstart", speeds]
        text = "gives speed_rpm itself, but the plan varies"
        with refused(text):
            config(*words)
        pinned = config(*words, "operating.speed_rpm=900")
        assert pinned["operating"]["speed_rpm"] == 900
