"""The groups ``plan`` and ``dataset`` of a configuration as typed values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

from gensig.dataset.distributions import GRID, Distribution, read_distribution
from gensig.errors import ConfigError
from gensig.options.configuration import Section, whole_number
from gensig.systems.shaft_sensors import SWITCHES
from gensig.units import check_choice

PREFIX = "store_"
CROSSED, SEPARATE = "crossed", "separate"  # values of plan.machines
# values of plan.fault_gear; a list of gears is the third
AS_GIVEN, DRAWN = "as_given", "drawn"
GEAR_KEYS = "gear."  # begin of varied keys that are drawn once a unit, ...
WITH_GEAR_KEYS = ("quality.",)  # ... and of those that are then drawn with them
TORQUE_KEY, UNIT_LOAD = "operating.torque_nm", "unit_load"


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetOptions:
    """Signals that a data set stores, and how its shards hold them.

    ``records_per_shard`` None means a number that grows with the set. Each ``store_`` switch
    adds signals; see ``configs/generate.yaml``.
    """

    records_per_shard: int | None
    compression: str
    sample_type: str
    store_clean: bool
    store_source: bool
    store_shaft_angle: bool
    store_operating: bool
    store_tacho: bool
    store_encoder: bool
    store_mesh_state: bool
    store_healthy_twin: bool
    store_detectability: bool

    @property
    def shaft_signals(self) -> tuple[str, ...]:
        """Names of the signals of shaft sensors that are stored."""
        return tuple(name for switch, name in SWITCHES.items() if getattr(self, switch))

    @property
    def needs_sound_records(self) -> bool:
        """True where every faulty record is simulated without its fault too."""
        return self.store_detectability or self.store_healthy_twin


def read_dataset_options(section: Section) -> DatasetOptions:
    """Options of the group ``dataset``.

    Raises
    ------
    ConfigError    for unknown or missing keys, and values of the wrong type
    """
    switches = [
        field.name for field in fields(DatasetOptions) if field.name.startswith(PREFIX)
    ]
    for key in switches:
        if key in section and not isinstance(section[key], bool):
            raise ConfigError(f"dataset.{key} = {section[key]!r} must be true or false")
    if section.get("records_per_shard") is not None:
        whole_number(
            "dataset.records_per_shard", section["records_per_shard"], at_least=1
        )
    return section.read(DatasetOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions:
    """Options of a plan, as configured.

    Attributes
    ----------
    n_records, conditions_per_unit : None where the other counts decide
    n_gearboxes : None for about the square root of the units, or where every unit has its own
    classes : names of the classes, by label
    vary : distribution of each varied key of the configuration
    sham : whether severities are zero while labels are kept
    machines : ``crossed``: every set of gears runs in every gearbox; ``separate``: every unit has
        gears and a gearbox of its own
    draws_unit_load : whether the values drawn for the torque are unit loads of the teeth, N/mm2
    fault_gear : ``as_given``: faults are on the gear that their option names; ``drawn``: on
        any gear of the machine, or on one of those listed, with equal chance for each condition
    n_reference : further healthy records of every unit, which are no examples
    """

    n_records: int | None
    n_units: int
    n_gearboxes: int | None
    conditions_per_unit: int | None
    n_repeats: int
    classes: tuple[str, ...]
    design: str
    vary: Mapping[str, Distribution]
    draws_unit_load: bool
    sham: bool
    # Keys that came after 0.9.0 have defaults: configurations of earlier data sets lack them.
    machines: str = CROSSED
    fault_gear: str | tuple[str, ...] = AS_GIVEN
    n_reference: int = 0

    @property
    def is_grid(self) -> bool:
        """True where every unit runs every combination of levels."""
        return self.design == GRID

    @property
    def varies_gears(self) -> bool:
        """True where units differ in the design of their gears."""
        return any(key.startswith(GEAR_KEYS) for key in self.vary)

    @property
    def unit_vary(self) -> dict[str, Distribution]:
        """Distributions of the keys that are drawn once a unit; none without those of gears."""
        if not self.varies_gears:
            return {}
        begins = (GEAR_KEYS, *WITH_GEAR_KEYS)
        return {key: self.vary[key] for key in self.vary if key.startswith(begins)}

    @property
    def condition_vary(self) -> dict[str, Distribution]:
        """Distributions of the keys that are drawn for each condition."""
        of_unit = self.unit_vary
        return {key: self.vary[key] for key in self.vary if key not in of_unit}

    @property
    def has_separate_machines(self) -> bool:
        """True where no two units share gears or a gearbox."""
        return self.machines == SEPARATE


FIELDS = {field.name: field for field in fields(PlanOptions)}
del FIELDS["draws_unit_load"]  # told by the key of the torque in ``vary``
KEYS = tuple(FIELDS)
REQUIRED = tuple(name for name, field in FIELDS.items() if field.default is MISSING)


def read_plan_options(plan: Section) -> PlanOptions:
    """Options of the group ``plan``.

    Raises
    ------
    ConfigError    for unknown or missing keys, and counts that cannot be used
    """
    _check_keys(plan)
    if not isinstance(plan["sham"], bool):
        raise ConfigError(f"plan.sham = {plan['sham']!r} must be true or false")
    whole_number("plan.n_units", plan["n_units"], at_least=1)
    whole_number("plan.n_repeats", plan["n_repeats"], at_least=1)
    for key in ("n_gearboxes", "conditions_per_unit"):
        if plan[key] is not None:
            whole_number(f"plan.{key}", plan[key], at_least=1)
    _check_machines(plan)
    fault_gear = _read_fault_gear(plan.get("fault_gear", AS_GIVEN))
    whole_number("plan.n_reference", plan.get("n_reference", 0), at_least=0)
    if plan["n_records"] is not None:
        whole_number("plan.n_records", plan["n_records"], at_least=len(plan["classes"]))
    vary = {key: _read_varied(key, spec) for key, spec in plan["vary"].items()}
    plain = plan.without("vary", "fault_gear")
    torque = plan["vary"].get(TORQUE_KEY)
    return plain.read(
        PlanOptions,
        vary=vary,
        fault_gear=fault_gear,
        draws_unit_load=isinstance(torque, Mapping) and torque.get("of") == UNIT_LOAD,
    )


def _read_fault_gear(given: Any) -> str | tuple[str, ...]:
    """Value of ``plan.fault_gear``: one of its words, or the names of gears."""
    if isinstance(given, list | tuple):
        names = tuple(given)
        if not names or len(set(names)) < len(names):
            raise ConfigError(
                f"plan.fault_gear = {list(names)} must name one gear or more, each once"
            )
        return names
    if given not in (AS_GIVEN, DRAWN):
        raise ConfigError(
            f"plan.fault_gear = {given!r}; allowed: {AS_GIVEN}, {DRAWN}, or a list of gears"
        )
    return str(given)


def _read_varied(key: str, spec: Any) -> Distribution:
    """Distribution of a key of ``plan.vary``; ``of: unit_load`` of the torque is left out."""
    if isinstance(spec, Mapping) and "of" in spec:
        if key != TORQUE_KEY or spec["of"] != UNIT_LOAD:
            raise ConfigError(
                f"plan.vary.{key}: of = {spec['of']!r}; only {TORQUE_KEY} may be drawn of "
                f"another size, {UNIT_LOAD}, in N/mm2"
            )
        spec = {name: value for name, value in spec.items() if name != "of"}
    return read_distribution(f"plan.vary.{key}", spec)


def _check_keys(plan: Section) -> None:
    odd = sorted(set(plan).difference(KEYS) | set(REQUIRED).difference(plan))
    if odd:
        state = "unknown" if odd[0] in plan else "missing"
        raise ConfigError(f"plan: {state} key '{odd[0]}'; it has {', '.join(KEYS)}")


def _check_machines(plan: Section) -> None:
    machines = plan.get("machines", CROSSED)
    check_choice("plan.machines", machines, (CROSSED, SEPARATE))
    if machines == SEPARATE and plan["n_gearboxes"] is not None:
        raise ConfigError(
            f"plan.n_gearboxes = {plan['n_gearboxes']!r}: with plan.machines={SEPARATE} every "
            "machine has a gearbox of its own; give plan.n_gearboxes=null"
        )
