"""From typed overrides to one plain configuration that decides everything, classes included."""

from __future__ import annotations

import copy
import difflib
import functools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.faults.registry import COMPOUND, fault_parts
from gensig.options.compose import compose, options, override_keys, typed_mapping
from gensig.options.configuration import Configuration
from gensig.plan.condition_courses import settle_courses
from gensig.systems.registry import SIDES

CONFIG_NAME = "generate"
VARY_KEYS = ("plan.vary", "fault.vary")


class DerivedValueWarning(UserWarning):
    """A value of the chosen gear option that no longer fits and is derived instead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A composed configuration and the overrides as typed.

    ``classes`` of ``config`` maps every class of the plan to its fault option, so that the folder of
    a data set needs no package to be understood. ``notes`` lists settings of the selected option that
    an override replaced.
    """

    config: Configuration
    overrides: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read_request(overrides: Sequence[str], *, config_dir: str | Path | None = None) -> Request:
    """Compose the configuration for one job.

    A ``fault.key=value`` is applied to every class of the plan whose option has that key, and pinned there.

    Raises
    ------
    ConfigError    with one line, for anything that cannot be used
    """
    as_typed = tuple(overrides)
    typed = override_keys(overrides)
    plan_vary, fault_vary = (typed_mapping(overrides, key) for key in VARY_KEYS)
    overrides = [word for word in overrides if not word.startswith(tuple(f"{key}=" for key in VARY_KEYS))]
    fault_words = {
        word.lstrip("+").partition("=")[0]: word for word in overrides if word.lstrip("+").startswith("fault.")
    }
    others = [word for word in overrides if word not in fault_words.values()]
    base = compose(CONFIG_NAME, others, config_dir=config_dir).plain()
    _check_shape(base)
    plan = base["plan"]
    names = [typed["fault"]] if "fault" in typed else plan["classes"] or [base["fault"]["kind"]]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ConfigError(f"plan.classes = {names!r} must be a list of different fault options")

    clear_fault_vary = "fault.vary" in typed and not fault_vary
    unused = {*fault_words, *(f"fault.{key}" for key in fault_vary)}
    pinned: dict[str, None] = {}

    def class_fault(name: str | None) -> dict[str, Any]:
        words = [word for word in others if name is None or not word.startswith("fault=")]
        words += [] if name is None else [f"fault={name}"]
        fault = base["fault"] if name is None else _fault_option(words, config_dir)
        mine = {key: word for key, word in fault_words.items() if key.split(".")[1] in fault and key != "fault.vary"}
        unused.difference_update(mine)
        if mine:
            fault = _fault_option([*words, *mine.values()], config_dir)
        unused.difference_update(f"fault.{key}" for key in fault_vary if key in fault)
        option = {} if clear_fault_vary else fault.get("vary") or {}
        vary = {**option, **{key: spec for key, spec in fault_vary.items() if key in fault}}
        pinned.update({f"fault.{key}": None for key in vary if f"fault.{key}" in mine})
        return {**fault, "vary": {key: spec for key, spec in vary.items() if f"fault.{key}" not in mine}}

    selected = _with_whole_parts(class_fault(None), config_dir)
    if "fault" in typed or not plan["classes"]:  # composing anew would give the same, as slowly
        classes = {name: copy.deepcopy(selected) for name in names}
    else:
        classes = {name: _with_whole_parts(class_fault(name), config_dir) for name in names}
    if unused:
        raise ConfigError(_no_such_fault_key(sorted(unused)[0], selected))
    notes = []
    if plan["classes"] and plan["classes"] != names:
        notes.append(f"fault={names[0]} replaces plan.classes [{', '.join(map(str, plan['classes']))}]")
    plan["classes"] = names
    plan_option = {} if "plan.vary" in typed and not plan_vary else plan["vary"] or {}
    plan_vary = {**plan_option, **plan_vary}
    plan["vary"] = {key: value for key, value in plan_vary.items() if key not in typed}
    pinned.update({key: None for key in plan_vary if key in typed})
    if pinned:
        notes.append(f"pinned, no longer varied: {', '.join(f'{key} = {typed[key]}' for key in pinned)}")
    base |= {"fault": selected, "classes": classes}
    _reset_derived(base["gear"], set(typed) | set(plan["vary"]))
    config = settle_courses(Configuration(base), typed)
    return Request(config=config, overrides=as_typed, notes=tuple(notes))


def _fault_option(overrides: Sequence[str], config_dir: str | Path | None) -> dict[str, Any]:
    """The fault of a configuration whose other groups are composed already, which has shown their mistakes.

    No fault of the package refers to a key of another group, so only groups and keys of the fault itself count.
    """
    if config_dir is not None or any("${" in word or word.startswith("hydra.") for word in overrides):
        return compose(CONFIG_NAME, overrides, config_dir=config_dir)["fault"].plain()
    keys = [(word, word.lstrip("+~").partition("=")[0]) for word in overrides]
    counting = (word for word, key in keys if "." not in key or key.startswith("fault."))
    return copy.deepcopy(_packaged_fault(tuple(word for word in counting if not word.startswith(PLAIN_WORDS))))


@functools.lru_cache(maxsize=64)
def _packaged_fault(overrides: tuple[str, ...]) -> dict[str, Any]:
    return compose(CONFIG_NAME, overrides)["fault"].plain()


def _with_whole_parts(fault: dict[str, Any], config_dir: str | Path | None) -> dict[str, Any]:
    """A compound fault whose parts have every key: what a part leaves out is its kind's option, ``vary`` included."""
    if fault["kind"] != COMPOUND:
        return fault
    parts = []
    for part in fault_parts(fault):
        if part.get("kind") in (None, COMPOUND, "healthy"):
            raise ConfigError(f"fault.parts: kind = {part.get('kind')!r}; give the kind of one single fault")
        option = _fault_option([f"fault={part['kind']}"], config_dir)
        vary = {key: spec for key, spec in (option.get("vary") or {}).items() if key not in part}
        parts.append({**option, "vary": vary, **part})
    return {**fault, "parts": parts}


SECTIONS = (
    "system", "gear", "material", "strength", "modification", "heat", "fault", "operating", "sensing", "plan", "life",
    "executor", "mesh", "wear", "solver", "quality", "dataset",
)  # fmt: skip
OPTIONAL_SECTIONS = ("excitation",)
PLAIN_KEYS = ("seed", "out")
PLAIN_WORDS = tuple(f"{key}=" for key in PLAIN_KEYS)


def _check_shape(composed: Mapping[str, Any]) -> None:
    """Raise for groups that were replaced or deleted, and for keys that nothing reads."""
    for key in SECTIONS:
        if not isinstance(composed.get(key), dict):
            raise ConfigError(
                f"{key} = {composed.get(key)!r} must be a group of keys; choose an option or leave it alone"
            )
    for key in composed:
        if key not in SECTIONS + OPTIONAL_SECTIONS + PLAIN_KEYS:
            raise ConfigError(f"unknown key '{key}'; the configuration has {', '.join(SECTIONS + PLAIN_KEYS)}")


def _no_such_fault_key(key: str, selected: Mapping[str, Any]) -> str:
    leaf = key.removeprefix("fault.")
    known = [name for name in selected if name not in ("kind", "vary")]
    close = difflib.get_close_matches(leaf, known, n=1, cutoff=0.8)  # a slip, not another fault's key
    if close:
        return f"unknown key '{key}'; did you mean 'fault.{close[0]}'?"
    has = f"it has {', '.join(known)}" if known else "it has no keys"
    return f"unknown key '{key}' for fault={selected['kind']}, {has}; fault offers: {', '.join(options('fault'))}"


def _reset_derived(gear: dict[str, Any], touched: set[str]) -> None:
    """Derive mass and inertia anew where teeth, module or width are no longer those the source weighed."""
    for side in SIDES:
        changed = sorted(touched & {"gear.normal_module_mm", f"gear.{side}.n_teeth", f"gear.{side}.face_width_mm"})
        lost = [
            key
            for key in ("mass_kg", "inertia_kg_m2")
            if changed and f"gear.{side}.{key}" not in touched and gear[side][key] is not None
        ]
        for key in lost:
            gear[side][key] = None
        if lost:
            warnings.warn(
                f"{', '.join(changed)} changed: {' and '.join(lost)} of the {side} are derived from a solid disc now",
                DerivedValueWarning,
                stacklevel=3,
            )
