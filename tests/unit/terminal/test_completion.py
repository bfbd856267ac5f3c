"""Candidates for a half-typed override: those of the options that the words before it chose."""

from argparse import Namespace

import pytest

from gensig.terminal.completion import candidates


@pytest.mark.parametrize(
    ("words", "offered", "absent"),
    [
        (["fault=crack"], "fault.crack_depth_mm=", "fault.pit_depth_mm="),
        (["fault=pitting"], "fault.pit_depth_mm=", "fault.crack_depth_mm="),
    ],
)
def test_keys_are_those_of_the_chosen_option(words, offered, absent):
    typed = Namespace(overrides=words, config_dir=None)
    result = candidates("fault.", typed, primary="generate")
    assert offered in result
    assert absent not in result
    assert result["fault="]  # with its remark
