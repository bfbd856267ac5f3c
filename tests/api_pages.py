"""The lists in docs/api, made from the docstrings. ``python tests/api_pages.py`` writes them."""

import inspect
import re
import textwrap
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "api"
PAGES = sorted(FOLDER.glob("*.md"))
BEGIN, END = "<!-- made by tests/api_pages.py -->", "<!-- end of what is made -->"


def page(path: Path) -> str:
    """The page with a line for each ``::: name``, and for the public names of modules."""
    text = path.read_text(encoding="utf-8")
    lines = [
        line for name in re.findall(r"^::: (\S+)$", text, re.M) for line in _lines(name)
    ]
    head, rest = text.split(BEGIN, 1)
    return "\n".join([head + BEGIN, "", *lines, "", END + rest.split(END, 1)[1]])


def _lines(name: str) -> list[str]:
    result = _resolved(name)
    text = f"- `{name}`: {_summary(result)}"
    if isinstance(result, ModuleType):
        text += f" Names: {', '.join(f'`{own}`' for own in _public(result))}."
    return textwrap.wrap(
        text.removesuffix(" Names: ."),
        100,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _resolved(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError:
        parent, _, own = name.rpartition(".")
        return getattr(_resolved(parent), own)


def _public(module: ModuleType) -> list[str]:
    """Names of functions and classes that the module itself defines, in its order."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (inspect.isfunction(value) or inspect.isclass(value))
        and value.__module__ == module.__name__
    ]


def _summary(found: Any) -> str:
    """First paragraph of the docstring, to its first full stop."""
    paragraph = " ".join((inspect.getdoc(found) or "").partition("\n\n")[0].split())
    return re.split(r"(?<=\.) (?=[A-Z])", paragraph)[0].replace("``", "`")


if __name__ == "__main__":
    for path in PAGES:
        path.write_text(page(path), encoding="utf-8")
