"""Refusals in one line."""

import re
from contextlib import contextmanager

import pytest

from gensig.errors import ConfigError


@contextmanager
def refused(words, error=ConfigError):
    """The block raises ``error``, and its message is one line that holds the words."""
    with pytest.raises(error, match=re.escape(words)) as caught:
        yield caught
    assert "\n" not in str(caught.value)
