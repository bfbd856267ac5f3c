"""Refusals in one line, and tables of them."""

import re
from ast import literal_eval
from collections.abc import Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from gensig.errors import ConfigError


@contextmanager
def refused(words, error=ConfigError):
    """The block raises ``error``, and its message is one line that holds the words, if any."""
    with pytest.raises(error, match=re.escape(words) or None) as caught:
        yield caught
    assert "\n" not in str(caught.value)


def refusals(table: Mapping[str, Any]) -> pytest.MarkDecorator:
    """One test a row of a table: ``words`` of the message -> what is ``given``."""
    return pytest.mark.parametrize(("words", "given"), table.items(), ids=[*table])


def given(words):
    """Values of ``key=value`` words, as Python writes them."""
    pairs = (word.split("=") for word in words.split())
    return {key: literal_eval(value) for key, value in pairs}
