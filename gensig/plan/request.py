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
from gensig.faults.registry import COMPOUND, FAULTS, fault_parts
from gensig.life.life_options import RUN_TO_FAILURE
from gensig.options import files as option_files
from gensig.options.compose import compose, options, override_keys, typed_mapping
from gensig.options.configuration import Configuration
from gensig.options.own_options import with_own_options
from gensig.plan.condition_courses import settle_courses
from gensig.record.options import AS_GIVEN
from gensig.systems.registry import SIDES

CONFIG_NAME = "generate"
VARY_KEYS = ("plan.vary", "fault.vary")


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
    overrides: Sequence[str], *, config_dir: str | Path | None = None
) -> Request:
    """Compose the configuration for one job.

    Options that the package does not have are looked for in ``config_dir``, else in ./configs.
    A ``fault.key=value`` is applied to every class of the plan whose option has that key, and
    pinned there. The whole configuration is composed once; fault options of classes are composed
    alone.

    Raises
    ------
    ConfigError    with one line, for anything that cannot be used
    """
    words = _typed_words(overrides)
    return with_own_options(
        lambda folder: _request(words, tuple(overrides), folder), config_dir
    )


def _request(
    words: _Words, overrides: tuple[str, ...], config_dir: str | Path | None
) -> Request:
    """Request of typed words; options of one's own are those of ``config_dir``."""
    base = compose(CONFIG_NAME, words.others, config_dir=config_dir).plain()
    _check_shape(base)
    notes = _plan_of_life(words, base)
    listed = base["plan"]["classes"]
    names = _class_names(words, base)
    selected = _class_fault(words, words.keys.get("fault"), base["fault"], config_dir)
    faults = {name: selected for name in names}
    if listed and "fault" not in words.keys:
        options_of = {
            name: _fault_option(words, name, (), config_dir) for name in names
        }
        faults = {
            name: _class_fault(words, name, option, config_dir)
            for name, option in options_of.items()
        }
    _refuse_unused(words, [selected, *faults.values()])
    if listed and listed != names:
        notes.append(
            f"fault={names[0]} replaces plan.classes [{', '.join(map(str, listed))}]"
        )
        if "plan.n_reference" not in words.keys and fault_parts(selected.option):
            base["plan"]["n_reference"] = 0  # no class of the plan is sound
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
    base["fault"] = copy.deepcopy(selected.option)
    base["classes"] = {
        name: copy.deepcopy(fault.option) for name, fault in faults.items()
    }
    _reset_derived(base["gear"], set(words.keys) | set(base["plan"]["vary"]))
    config = settle_courses(Configuration(base), words.keys)
    return Request(config=config, overrides=overrides, notes=tuple(notes))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Words:
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


def _typed_words(overrides: Sequence[str]) -> _Words:
    keys = override_keys(overrides)
    plan_vary, fault_vary = (typed_mapping(overrides, key) for key in VARY_KEYS)
    plain = [
        word
        for word in overrides
        if not word.startswith(tuple(f"{key}=" for key in VARY_KEYS))
    ]
    of_fault = [word for word in plain if word.lstrip("+").startswith("fault.")]
    return _Words(
        keys=keys,
        plan_vary=plan_vary,
        fault_vary=fault_vary,
        fault_words={word.lstrip("+").partition("=")[0]: word for word in of_fault},
        others=tuple(word for word in plain if word not in of_fault),
    )


def _plan_of_life(words: _Words, base: dict[str, Any]) -> list[str]:
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


def _class_names(words: _Words, base: Mapping[str, Any]) -> list[str]:
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
    words: _Words,
    name: str | None,
    option: dict[str, Any],
    config_dir: str | Path | None,
) -> _ClassFault:
    """A fault option with the typed keys that it has.

    ``name`` None for that of the whole configuration.
    """
    typed = {
        key: word
        for key, word in words.fault_words.items()
        if key.split(".")[1] in option
    }
    typed.pop("fault.vary", None)
    if typed:
        option = _fault_option(words, name, tuple(typed.values()), config_dir)
    known = {key: spec for key, spec in words.fault_vary.items() if key in option}
    vary = dict(known)
    if not words.clears("fault.vary"):
        vary = {**(option.get("vary") or {}), **known}
    left = {key: spec for key, spec in vary.items() if f"fault.{key}" not in typed}
    return _ClassFault(
        option=_with_whole_parts({**option, "vary": left}, words, config_dir),
        used=frozenset({*typed, *(f"fault.{key}" for key in known)}),
        pinned=tuple(f"fault.{key}" for key in vary if f"fault.{key}" in typed),
    )


def _fault_option(
    words: _Words,
    name: str | None,
    fault_words: tuple[str, ...],
    config_dir: str | Path | None,
) -> dict[str, Any]:
    """A fault option by its name, with words that its keys are given by.

    Its file is composed alone, which takes a third of the time. The whole configuration is
    composed where the name is not known, where an experiment sets keys of the fault, and where
    composing alone fails: for an option of one's own that refers to another group, and for its
    message where no such option exists.
    """
    removed = tuple(word for word in words.others if word.startswith("~fault."))
    if name is not None and not _experiment_sets_fault(
        words.keys.get("experiment"), config_dir
    ):
        try:
            return copy.deepcopy(
                _option_alone(name, (*removed, *fault_words), config_dir)
            )
        except ConfigError:
            pass
    others = [
        word for word in words.others if name is None or not word.startswith("fault=")
    ]
    chosen = [] if name is None else [f"fault={name}"]
    whole = compose(
        CONFIG_NAME, [*others, *chosen, *fault_words], config_dir=config_dir
    )
    return whole["fault"].plain()


def _experiment_sets_fault(
    experiment: str | None, config_dir: str | Path | None
) -> bool:
    """True where an experiment's file sets keys of any chosen fault, such as its gear."""
    if experiment in (None, "null"):
        return False
    keys = option_files.option_keys("experiment", experiment, config_dir)
    return any(key.name.startswith("fault.") for key in keys)


def _option_alone(
    name: str, words: tuple[str, ...], config_dir: str | Path | None
) -> dict[str, Any]:
    if config_dir is not None:
        return compose(f"fault/{name}", words, config_dir=config_dir)["fault"].plain()
    return _packaged_option(name, words)


@functools.lru_cache(maxsize=64)
def _packaged_option(name: str, words: tuple[str, ...]) -> dict[str, Any]:
    return compose(f"fault/{name}", words)["fault"].plain()


def _with_whole_parts(
    fault: dict[str, Any], words: _Words, config_dir: str | Path | None
) -> dict[str, Any]:
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
        option = _fault_option(words, part["kind"], (), config_dir)
        vary = {
            key: spec
            for key, spec in (option.get("vary") or {}).items()
            if key not in part
        }
        parts.append({**option, "vary": vary, **part})
    return {**fault, "parts": parts}


def _refuse_unused(words: _Words, faults: Sequence[_ClassFault]) -> None:
    """Raise for a typed key that no class of the plan has."""
    typed = {*words.fault_words, *(f"fault.{key}" for key in words.fault_vary)}
    unused = typed.difference(*(fault.used for fault in faults))
    if unused:
        raise ConfigError(_no_such_fault_key(sorted(unused)[0], faults[0].option))


def _pin_varied(words: _Words, plan: dict[str, Any]) -> list[str]:
    """Put what is drawn into ``plan``; returns the typed keys, which are no longer drawn."""
    vary = dict(words.plan_vary)
    if not words.clears("plan.vary"):
        vary = {**(plan["vary"] or {}), **vary}
    plan["vary"] = {key: spec for key, spec in vary.items() if key not in words.keys}
    return [key for key in vary if key in words.keys]


def _keep_typed_gear(words: _Words, plan: dict[str, Any]) -> list[str]:
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
                stacklevel=3,
            )
