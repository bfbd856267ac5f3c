"""Typed overrides of a request by what they are for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.options.compose import in_digits, override_keys, typed_mapping

VARY_KEYS = ("plan.vary", "fault.vary")


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """Typed overrides by what they are for.

    Attributes
    ----------
    keys : keys and groups, each with its value as text
    plan_vary, fault_vary : content of ``plan.vary={...}`` and ``fault.vary={...}``
    fault_words : override of each typed key of the fault
    others : all the rest
    """

    keys: Mapping[str, str]
    plan_vary: Mapping[str, Any]
    fault_vary: Mapping[str, Any]
    fault_words: Mapping[str, str]
    others: tuple[str, ...]

    def clears(self, key: str) -> bool:
        """Return whether an empty mapping was typed for ``plan.vary`` or ``fault.vary``."""
        return key in self.keys and not (
            self.plan_vary if key == "plan.vary" else self.fault_vary
        )


def typed_words(overrides: Sequence[str]) -> Words:
    """Overrides by what they are for.

    Raises
    ------
    ConfigError    for a word that cannot be read, and for several values of a key
    """
    overrides = in_digits(overrides)
    keys = override_keys(overrides)
    plan_vary, fault_vary = (typed_mapping(overrides, key) for key in VARY_KEYS)
    plain = [
        word
        for word in overrides
        if not word.startswith(tuple(f"{key}=" for key in VARY_KEYS))
    ]
    of_fault = [word for word in plain if word.lstrip("+").startswith("fault.")]
    return Words(
        keys=keys,
        plan_vary=plan_vary,
        fault_vary=fault_vary,
        fault_words={word.lstrip("+").partition("=")[0]: word for word in of_fault},
        others=tuple(word for word in plain if word not in of_fault),
    )
