"""The plan: every input of every record, drawn and frozen before anything runs."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gensig.dataset.distributions import design_points, values_at
from gensig.dataset.plan import Plan, record_ids, shard_places
from gensig.errors import ConfigError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import COMPOUND, fault_parts, read_faults
from gensig.mesh.pair_table import check_teeth
from gensig.records import MISSING, Stream, read_seed, record_system, replace_key, stream, whole_number
from gensig.systems.registry import read_system
from gensig.systems.spur_pair import severity
from gensig.units import from_si

SHARD_BYTES = 65_536_000  # 80 records of 4 x 51,200 float32 samples


def make_plan(config: Mapping[str, Any]) -> Plan:
    """Draw every input of every record.

    Records come in groups of one a class that share unit and condition, in random order within the group, so that
    neither position nor any drawn value tells the class.

    Raises
    ------
    ConfigError    for counts, keys or distributions that cannot be used
    """
    plan, seed = config["plan"], read_seed(config)
    names = list(plan["classes"])
    n_records = whole_number("plan.n_records", plan["n_records"], at_least=len(names))
    n_units = whole_number("plan.n_units", plan["n_units"], at_least=1)
    asked = round(math.sqrt(n_units)) if plan["n_gearboxes"] is None else plan["n_gearboxes"]
    n_gearboxes = min(n_units, whole_number("plan.n_gearboxes", asked, at_least=1))
    if not isinstance(plan["sham"], bool):
        raise ConfigError(f"plan.sham = {plan['sham']!r} must be true or false")
    read_system(config).check()
    n_groups = math.ceil(n_records / len(names))
    for key in plan["vary"]:
        replace_key(copy.deepcopy(dict(config)), key, 0.0)
    conditions = _draw(config, plan["vary"], n_groups, stream(seed, Stream.CONDITION), "plan")
    faults = {
        name: _draw_faults(config, fault, n_groups, stream(seed, Stream.FAULT, index))
        for index, (name, fault) in enumerate(config["classes"].items())
    }
    rows: list[dict[str, Any]] = []
    for group in range(n_groups):
        unit = group % n_units
        gearbox, specimen = unit % n_gearboxes, unit // n_gearboxes
        for place in stream(seed, Stream.ORDER, group).permutation(len(names)):
            if len(rows) == n_records:
                break
            name = names[place]
            values = {key: drawn[group] for key, drawn in conditions.items()}
            rows.append(
                {
                    "label": int(place),
                    "label_name": name,
                    "unit_id": f"unit-{unit:04d}",
                    "gearbox_id": f"gearbox-{gearbox:04d}",
                    "specimen_id": f"specimen-{specimen:04d}",
                    "condition_id": f"condition-{group:06d}",
                    **_row(config, seed, len(rows), faults[name][group], values),
                }
            )
    return _as_plan(config, rows)


def _row(
    config: Mapping[str, Any], seed: int, index: int, fault: dict[str, Any], values: dict[str, float]
) -> dict[str, Any]:
    """Columns of one record that follow from its drawn values; building its machine checks them all."""
    system = record_system(config, values)
    system.pair.require_continuous_drive()
    applied = read_faults(fault)
    check_teeth(system.pair, system.material, system.mesh, faulty_teeth(system.pair, applied))
    rng = stream(seed, Stream.START, index)
    parts = fault_parts(fault)
    return {
        "faults_json": json.dumps(parts, separators=(",", ":")),
        "severity": 0.0 if config["plan"]["sham"] else severity(applied, system.pair),
        "fault_gear": applied[0].gear if applied else "",
        "fault_tooth": applied[0].first_tooth if applied else -1,
        "start_tooth_pinion": int(rng.integers(system.pair.pinion.n_teeth)),
        "start_tooth_wheel": int(rng.integers(system.pair.wheel.n_teeth)),
        "start_phase": float(rng.random()),
        "speed_set_rpm": from_si("speed_rpm", system.operating.speed),
        "torque_nm": system.operating.torque,
        "snr_db": MISSING if system.sensing.snr is None else system.sensing.snr,
        **{f"params/{key}": float(value) for key, value in values.items()},
        **{f"params/fault.{key}": value for key, value in _sizes(fault).items()},
    }


def _as_plan(config: Mapping[str, Any], rows: list[dict[str, Any]]) -> Plan:
    """Rows to columns; a parameter that a record has not is NaN."""
    names: dict[str, None] = {}
    for row in rows:
        names.update(dict.fromkeys(row))
    shard, place = shard_places(len(rows), records_per_shard(config))
    columns: dict[str, Any] = {"record_id": record_ids(len(rows)), "shard": shard, "row": place}
    for name in names:
        columns[name] = np.array([row.get(name, MISSING) for row in rows])
    return Plan(columns=columns)


def records_per_shard(config: Mapping[str, Any]) -> int:
    """As configured, else about 64 MB of samples."""
    given = config["dataset"]["records_per_shard"]
    if given is not None:
        return whole_number("dataset.records_per_shard", given, at_least=1)
    return max(1, SHARD_BYTES // record_bytes(config))


def record_bytes(config: Mapping[str, Any], *, as_stored: bool = False) -> int:
    """Bytes of one record's samples, ``as_stored`` in the chosen type before compression, else in single precision.

    Shards are cut by the latter, so that how samples are stored does not change a plan.
    """
    system, dataset = read_system(config), config["dataset"]
    n_samples = round(system.operating.duration * system.sensing.sampling_rate)
    n_copies = 2 if dataset["store_clean"] else 1
    size = 2 if as_stored and dataset["sample_type"] == "int16" else 4
    angle = 8 * n_samples if dataset["store_shaft_angle"] else 0
    return max(1, size * n_copies * len(system.sensing.channels) * n_samples + angle)


def check_switches(config: Mapping[str, Any]) -> None:
    """Raise ConfigError for a switch of ``dataset`` that is neither true nor false."""
    for key in ("store_clean", "store_shaft_angle"):
        if not isinstance(config["dataset"][key], bool):
            raise ConfigError(f"dataset.{key} = {config['dataset'][key]!r} must be true or false")


def _draw(
    config: Mapping[str, Any], vary: Mapping[str, Any], n: int, rng: np.random.Generator, where: str
) -> dict[str, list[Any]]:
    """Values of every varied key, (n,) each, from one space-filling design."""
    points = design_points(config["plan"]["design"], n, len(vary), rng)
    return {key: values_at(f"{where}.vary.{key}", spec, points[:, k]) for k, (key, spec) in enumerate(vary.items())}


def _sizes(fault: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a fault by key; those of a compound one carry the place of their part."""
    if "parts" in fault:
        numbered = enumerate(fault["parts"])
        return {f"parts.{place}.{key}": value for place, part in numbered for key, value in _sizes(part).items()}
    numbers = {key: value for key, value in fault.items() if isinstance(value, int | float) and key != "tooth"}
    return {key: float(value) for key, value in numbers.items()}


def _draw_faults(
    config: Mapping[str, Any], fault: Mapping[str, Any], n: int, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """One complete fault a group, its severity distribution drawn; one design for all parts of a compound fault."""
    read_faults(fault)
    parts = [{key: value for key, value in part.items() if key != "vary"} for part in fault_parts(fault)]
    specs: dict[str, Any] = {}
    places: dict[str, tuple[int, str]] = {}
    for place, (plain, part) in enumerate(zip(parts, fault_parts(fault), strict=True)):
        for key, spec in (part.get("vary") or {}).items():
            if key not in plain:
                raise ConfigError(f"fault.vary: '{key}' is no key of fault={plain['kind']}")
            name = f"parts.{place}.{key}" if fault["kind"] == COMPOUND else key
            specs[name], places[name] = _tooth_range(config, plain["gear"], spec), (place, key)
    drawn = _draw(config, specs, n, rng, "fault")
    faults: list[dict[str, Any]] = []
    for group in range(n):
        own = [dict(plain) for plain in parts]
        for name, values in drawn.items():
            place, key = places[name]
            own[place][key] = values[group]
        faults.append({"kind": fault["kind"], "parts": own} if fault["kind"] == COMPOUND else (own or [dict(fault)])[0])
    return faults


def _tooth_range(config: Mapping[str, Any], gear: str, spec: Any) -> Any:
    """``distribution: tooth`` as whole numbers over the gear's teeth, anything else as it is."""
    if not (isinstance(spec, Mapping) and spec.get("distribution") == "tooth"):
        return spec
    return {"distribution": "integers", "low": 0, "high": config["gear"][gear]["n_teeth"] - 1}
