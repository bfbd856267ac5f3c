"""Option files of a user's folder: what is listed of them, and what is refused."""

import pytest
from refusals import refused

from gensig.options.files import chosen_options, groups, option_keys, options

MINE = "mine"


@pytest.fixture
def written(tmp_path):
    """Function that writes the option gear=mine and gives its folder."""

    def make(text, group="gear"):
        (tmp_path / group).mkdir()
        (tmp_path / group / f"{MINE}.yaml").write_text(text)
        return tmp_path

    return make


def test_an_option_of_comments_alone_has_a_line_and_no_keys(written):
    folder = written("# Our pair. More.\n")
    (option,) = [each for each in options("gear", folder) if each.name == MINE]
    assert option.about == "Our pair"
    assert option_keys("gear", MINE, folder) == []
    assert chosen_options("gear", MINE, folder) == {}


def test_a_group_of_the_user_follows_those_of_the_package(written):
    folder = written("a: 1\n", group="bench")
    *packaged, group = groups(folder)
    assert packaged == groups()
    assert (group.name, group.default) == ("bench", None)


def test_choices_of_an_experiment_with_those_that_it_builds_on(written):
    base = "defaults: [two_stage, {override /heat: chongqing_rated}]\n"
    folder = written(base, group="experiment")
    assert chosen_options("experiment", MINE, folder) == {
        "system": "two_stage_gearbox",
        "sensing": "geared_line_bearings",
        "heat": "chongqing_rated",
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("defaults: [nothing]\n", "no option 'nothing' of gear"),
        ("name: [1\n", "gear/mine.yaml is no YAML: while parsing a flow sequence"),
    ],
)
def test_a_broken_option_is_refused(written, text, message):
    with refused(message):
        option_keys("gear", MINE, written(text))


def test_a_missing_folder_is_refused():
    with refused("--config-dir nowhere is not a folder"):
        options("gear", "nowhere")
