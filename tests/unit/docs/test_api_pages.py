"""docs/api tells readers of the files what the site shows."""

import api_pages
import pytest


@pytest.mark.parametrize("path", api_pages.PAGES, ids=lambda path: path.stem)
def test_lists_are_those_of_the_docstrings(path):
    assert path.read_text(encoding="utf-8") == api_pages.page(path), (
        "run python tests/api_pages.py"
    )


def test_all_that_gensig_offers_is_listed():
    import gensig

    text = (api_pages.FOLDER / "gensig.md").read_text(encoding="utf-8")
    assert [
        name
        for name in gensig.__all__
        if name != "__version__" and f"\n::: gensig.{name}\n" not in text
    ] == []
