"""Refusals in one line."""

import re
from ast import literal_eval
from contextlib import contextmanager

import pytest

from gensig.errors import ConfigError


@contextmanager
def refused(words, error=ConfigError):
    """The block raises ``error``, and its message is one line that holds the words."""
    with pytest.raises(error, match=re.escape(words)) as caught:
        yield caught
    assert "\n" not in str(caught.value)


def given(words):
    """What ``key=value`` words give, values as Python writes them."""
    pairs = (word.split("=") for word in words.split())
    return {key: literal_eval(value) for key, value in pairs}
