"""Every example of a help text, which docs/commands.md collects, runs by itself."""

import pytest
from page_commands import EXAMPLES, commands


@pytest.mark.parametrize("words", commands(EXAMPLES), ids=" ".join)
def test_an_example_of_a_verb_runs(words, workshop):
    workshop.run(words)
