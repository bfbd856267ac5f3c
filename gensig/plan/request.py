"""From typed overrides to one plain configuration that decides everything, classes included."""

from __future__ import annotations

import copy
import difflib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.faults.registry import (
    COMPOUND,
    FAULTS,
    fault_parts,
    without_later_keys,
)
from gensig.life.life_options import RUN_TO_FAILURE
from gensig.options.configuration import Configuration
from gensig.options.groups import options
from gensig.options.own_options import with_own_options
from gensig.options.plain_values import require_keys
from gensig.plan.condition_courses import settle_courses
from gensig.plan.sources import OptionFiles, Source, StoredConfiguration, read_stored
from gensig.plan.words import Words, typed_words
from gensig.record.options import AS_GIVEN
from gensig.systems.registry import SIDES

STORED_FLAG = (
    "--config"  # begins the recorded words of a request on a stored configuration
)


class DerivedValueWarning(UserWarning):
    """A value of the chosen gear option that no longer fits and is derived instead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A composed configuration and the overrides as typed.

    ``classes`` of ``config`` maps every class of the plan to its fault option, so that the folder
    of a data set needs no package to be understood. ``notes`` lists settings of the selected
    option that an override replaced.
    """

    config: Configuration
    overrides: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read_request(
    overrides: Sequence[str],
    *,
    config_dir: str | Path | None = None,
    stored: str | Path | None = None,
) -> Request:
    """Compose the configuration for one job.

    Options that the package does not have are looked for in ``config_dir``, else in ./configs.
    A ``fault.key=value`` is applied to every class of the plan whose option has that key, and
    pinned there. The whole configuration is composed once; fault options of classes are composed
    alone.

    Parameters
    ----------
    overrides : ``group=option`` and ``key=value`` as typed
    config_dir : folder of a user's own options
    stored : ``config.yaml`` of a data set or its folder, which takes the place of the options;
        its data set is made again where nothing is typed

    Raises
    ------
    ConfigError    with one line, for anything that cannot be used
    """
    words, typed = typed_words(overrides), tuple(overrides)
    if stored is None:
        return with_own_options(
            lambda folder: _request(OptionFiles(words=words, config_dir=folder), typed),
            config_dir,
        )
    content = read_stored(stored)
    typed = (f"{STORED_FLAG} {stored}", *typed)
    return with_own_options(
        lambda folder: _request(
            StoredConfiguration(words=words, config_dir=folder, content=content), typed
        ),
        config_dir,
    )


def _request(source: Source, overrides: tuple[str, ...]) -> Request:
    """Request of typed words on top of what a source has."""
    words = source.words
    base = source.base()
    _check_shape(base)
    notes = _plan_of_life(words, base)
    listed = base["plan"]["classes"]
    names = _class_names(words, base)
    selected = _class_fault(source, words.keys.get("fault"), base["fault"])
    faults = {name: selected for name in names}
    if listed and "fault" not in words.keys:
        options_of = {name: source.fault_option(name) for name in names}
        faults = {
            name: _class_fault(source, name, option)
            for name, option in options_of.items()
        }
    _refuse_unused(words, [selected, *faults.values()])
    if listed and listed != names:
        notes.append(
            f"fault={names[0]} replaces plan.classes [{', '.join(map(str, listed))}]"
        )
        if "plan.n_reference" not in words.keys and fault_parts(selected.option):
            base["plan"]["n_reference"] = 0  # no class of the plan is healthy
    base["plan"]["classes"] = names
    notes += _keep_typed_gear(words, base["plan"])
    pinned = dict.fromkeys(
        key for fault in (selected, *faults.values()) for key in fault.pinned
    )
    pinned |= dict.fromkeys(_pin_varied(words, base["plan"]))
    if pinned:
        notes.append(
            f"pinned, no longer varied: {', '.join(f'{key} = {words.keys[key]}' for key in pinned)}"
        )
    base["fault"] = without_later_keys(copy.deepcopy(selected.option))
    base["classes"] = {
        name: without_later_keys(copy.deepcopy(fault.option))
        for name, fault in faults.items()
    }
    _reset_derived(base["gear"], set(words.keys) | set(base["plan"]["vary"]))
    config = settle_courses(Configuration(base), source.pinned_keys())
    return Request(config=config, overrides=overrides, notes=tuple(notes))


def _plan_of_life(words: Words, base: dict[str, Any]) -> list[str]:
    """Give lives the plan that they need, where none is typed; returns the note.

    Lives and their snapshots say how many records there are, and their laws which faults grow.
    """
    life, plan = base["life"], base["plan"]
    if life.get("kind") != RUN_TO_FAILURE:
        return []
    brought = []
    if plan["n_records"] is not None and "plan.n_records" not in words.keys:
        plan["n_records"] = None
        brought.append("plan.n_records = null")
    grown = [kind for kind in FAULTS if life.get(kind) is not None]
    is_sound = not fault_parts(base["fault"]) and "fault" not in words.keys
    if plan["classes"] is None and is_sound and grown:
        plan["classes"] = grown
        brought.append(f"plan.classes = [{', '.join(grown)}]")
    if not brought:
        return []
    return [f"lives have {', '.join(brought)}"]


def _class_names(words: Words, base: Mapping[str, Any]) -> list[str]:
    """Fault options of the plan's classes."""
    names = base["plan"]["classes"] or [base["fault"]["kind"]]
    if "fault" in words.keys:
        names = [words.keys["fault"]]
    is_list = isinstance(names, list) and all(isinstance(name, str) for name in names)
    if not is_list or len(set(names)) < len(names):
        raise ConfigError(
            f"plan.classes = {names!r} must be a list of different fault options"
        )
    return names


@dataclass(frozen=True, slots=True, kw_only=True)
class _ClassFault:
    """Fault option of one class with the typed keys put in.

    ``used`` are the typed keys that the option has, ``pinned`` those that its ``vary`` no longer
    draws.
    """

    option: dict[str, Any]
    used: frozenset[str]
    pinned: tuple[str, ...]


def _class_fault(
    source: Source, name: str | None, option: dict[str, Any]
) -> _ClassFault:
    """A fault option with the typed keys that it has.

    ``name`` None for that of the whole configuration.
    """
    words = source.words
    require_keys(option, f"fault={name or 'option'}", "kind")
    typed = {
        key: word
        for key, word in words.fault_words.items()
        if key.split(".")[1] in option
    }
    typed.pop("fault.vary", None)
    if typed:
        option = source.fault_option(name, tuple(typed.values()))
    known = {key: spec for key, spec in words.fault_vary.items() if key in option}
    vary = dict(known)
    if not words.clears("fault.vary"):
        vary = {**(option.get("vary") or {}), **known}
    left = {key: spec for key, spec in vary.items() if f"fault.{key}" not in typed}
    return _ClassFault(
        option=_with_whole_parts({**option, "vary": left}, source),
        used=frozenset({*typed, *(f"fault.{key}" for key in known)}),
        pinned=tuple(f"fault.{key}" for key in vary if f"fault.{key}" in typed),
    )


def _with_whole_parts(fault: dict[str, Any], source: Source) -> dict[str, Any]:
    """A compound fault whose parts have every key.

    What a part leaves out is its kind's option, ``vary`` included.
    """
    if fault["kind"] != COMPOUND:
        return fault
    parts = []
    for part in fault_parts(fault):
        if part.get("kind") in (None, COMPOUND, "healthy"):
            raise ConfigError(
                f"fault.parts: kind = {part.get('kind')!r}; give the kind of one single fault"
            )
        option = source.fault_option(part["kind"])
        vary = {
            key: spec
            for key, spec in (option.get("vary") or {}).items()
            if key not in part
        }
        parts.append({**option, "vary": vary, **part})
    return {**fault, "parts": parts}


def _refuse_unused(words: Words, faults: Sequence[_ClassFault]) -> None:
    """Raise for a typed key that no class of the plan has."""
    typed = {*words.fault_words, *(f"fault.{key}" for key in words.fault_vary)}
    unused = typed.difference(*(fault.used for fault in faults))
    if unused:
        raise ConfigError(_no_such_fault_key(sorted(unused)[0], faults[0].option))


def _pin_varied(words: Words, plan: dict[str, Any]) -> list[str]:
    """Put what is drawn into ``plan``; returns the typed keys, which are no longer drawn."""
    vary = dict(words.plan_vary)
    if not words.clears("plan.vary"):
        vary = {**(plan["vary"] or {}), **vary}
    plan["vary"] = {key: spec for key, spec in vary.items() if key not in words.keys}
    return [key for key in vary if key in words.keys]


def _keep_typed_gear(words: Words, plan: dict[str, Any]) -> list[str]:
    """Leave faults on the gear that was typed, where an option draws it; returns the note."""
    typed = [key for key in ("fault.gear", "fault.parts") if key in words.keys]
    drawn = plan.get("fault_gear", AS_GIVEN) != AS_GIVEN
    if not typed or not drawn or "plan.fault_gear" in words.keys:
        return []
    plan["fault_gear"] = AS_GIVEN
    return [f"{typed[0]} is given: plan.fault_gear = {AS_GIVEN}"]


SECTIONS = (
    "system",
    "gear",
    "material",
    "strength",
    "modification",
    "heat",
    "fault",
    "operating",
    "sensing",
    "plan",
    "life",
    "executor",
    "mesh",
    "wear",
    "solver",
    "quality",
    "dataset",
)
OPTIONAL_SECTIONS = ("excitation",)
PLAIN_KEYS = ("seed", "out")


def _check_shape(composed: Mapping[str, Any]) -> None:
    """Raise for groups that were replaced or deleted, and for keys that nothing reads."""
    for key in SECTIONS:
        if not isinstance(composed.get(key), dict):
            raise ConfigError(
                f"{key} = {composed.get(key)!r} must be a group of keys; choose an option "
                "or leave it alone"
            )
    require_keys(composed["fault"], "fault", "kind")
    require_keys(composed["plan"], "plan", "classes", "n_records", "vary")
    for side in SIDES:
        if not isinstance(composed["gear"].get(side), dict):
            raise ConfigError(
                f"gear.{side} = {composed['gear'].get(side)!r} must be a group of keys; complete "
                "the option of gear, or choose another"
            )
    for key in composed:
        if key not in SECTIONS + OPTIONAL_SECTIONS + PLAIN_KEYS:
            raise ConfigError(
                f"unknown key '{key}'; the configuration has {', '.join(SECTIONS + PLAIN_KEYS)}"
            )


def _no_such_fault_key(key: str, selected: Mapping[str, Any]) -> str:
    leaf = key.removeprefix("fault.")
    known = [name for name in selected if name not in ("kind", "vary")]
    close = difflib.get_close_matches(
        leaf, known, n=1, cutoff=0.8
    )  # a slip, not another fault's key
    if close:
        return f"unknown key '{key}'; did you mean 'fault.{close[0]}'?"
    has = f"it has {', '.join(known) or 'no keys'}"
    return (
        f"unknown key '{key}' for fault={selected['kind']}, {has}; fault offers: "
        f"{', '.join(options('fault'))}"
    )


def _reset_derived(gear: dict[str, Any], touched: set[str]) -> None:
    """Derive mass and inertia anew where teeth, module or width are no longer those the source
    weighed.
    """
    for side in SIDES:
        changed = sorted(
            touched
            & {
                "gear.normal_module_mm",
                f"gear.{side}.n_teeth",
                f"gear.{side}.face_width_mm",
            }
        )
        lost = [
            key
            for key in ("mass_kg", "inertia_kg_m2")
            if changed
            and f"gear.{side}.{key}" not in touched
            and gear[side][key] is not None
        ]
        for key in lost:
            gear[side][key] = None
        if lost:
            warnings.warn(
                (
                    f"{', '.join(changed)} changed: {' and '.join(lost)} of the {side} are "
                    "derived from a solid disc now"
                ),
                DerivedValueWarning,
                stacklevel=6,  # the caller of read_request
            )
