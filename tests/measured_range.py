"""A measured range of made-up numbers."""

from gensig.report.realism import Range

VALUES = {
    "id": "a.b",
    "at": "here",
    "unit": "ms",
    "low": 1.0,
    "high": 2.0,
    "source": "rig",
}


def measured(**changes) -> Range:
    return Range(**{**VALUES, **changes})
