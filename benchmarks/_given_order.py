"""Plugin of pytest: test files run in the order of the command line, whatever a conftest sorts."""

from __future__ import annotations

from collections.abc import Generator

import pytest


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(
    items: list[pytest.Item],
) -> Generator[None, None, None]:
    """Put the items that others keep back into their first order."""
    given = list(items)
    yield
    kept = set(items)
    items[:] = [item for item in given if item in kept]
