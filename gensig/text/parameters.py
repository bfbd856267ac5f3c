"""Configuration keys of sizes in words."""

from __future__ import annotations


def size_words(name: str) -> tuple[str, str]:
    """Words and unit of a size: ("crack depth", "mm") of ``crack_depth_mm``.

    A name of one word has no unit.

    Parameters
    ----------
    name : last part of a key, which ends in its unit
    """
    *words, unit = name.split("_")
    if not words:
        return unit, ""
    return " ".join(words), unit
