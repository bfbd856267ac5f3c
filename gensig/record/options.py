"""The groups ``plan`` and ``dataset`` of a configuration as typed values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from gensig.dataset.distributions import GRID, Distribution, read_distribution
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration, Section, whole_number
from gensig.systems.shaft_sensors import SWITCHES

PREFIX = "store_"


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetOptions:
    """Signals that a data set stores, and how its shards hold them.

    ``records_per_shard`` None means about 64 MB of samples. Each ``store_`` switch adds signals;
    see ``configs/generate.yaml``.
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


def read_dataset_options(config: Configuration) -> DatasetOptions:
    """Data-set options of a configuration.

    Raises
    ------
    ConfigError    for unknown or missing keys, and values of the wrong type
    """
    section = config.section("dataset")
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
    n_gearboxes : None for about the square root of the units
    classes : names of the classes, by label
    vary : distribution of each varied key of the configuration
    sham : whether severities are zero while labels are kept
    """

    n_records: int | None
    n_units: int
    n_gearboxes: int | None
    conditions_per_unit: int | None
    n_repeats: int
    classes: tuple[str, ...]
    design: str
    vary: Mapping[str, Distribution]
    sham: bool

    @property
    def is_grid(self) -> bool:
        """True where every unit runs every combination of levels."""
        return self.design == GRID


KEYS = tuple(field.name for field in fields(PlanOptions))


def read_plan_options(config: Configuration) -> PlanOptions:
    """Plan options of a configuration.

    Raises
    ------
    ConfigError    for unknown or missing keys, and counts that cannot be used
    """
    plan = config.section("plan")
    _check_keys(plan)
    if not isinstance(plan["sham"], bool):
        raise ConfigError(f"plan.sham = {plan['sham']!r} must be true or false")
    whole_number("plan.n_units", plan["n_units"], at_least=1)
    whole_number("plan.n_repeats", plan["n_repeats"], at_least=1)
    for key in ("n_gearboxes", "conditions_per_unit"):
        if plan[key] is not None:
            whole_number(f"plan.{key}", plan[key], at_least=1)
    if plan["n_records"] is not None:
        whole_number("plan.n_records", plan["n_records"], at_least=len(plan["classes"]))
    vary = {
        key: read_distribution(f"plan.vary.{key}", spec)
        for key, spec in plan["vary"].items()
    }
    return plan.without("vary").read(PlanOptions, vary=vary)


def _check_keys(plan: Section) -> None:
    odd = sorted(set(plan).symmetric_difference(KEYS))
    if odd:
        state = "unknown" if odd[0] in plan else "missing"
        raise ConfigError(f"plan: {state} key '{odd[0]}'; it has {', '.join(KEYS)}")
