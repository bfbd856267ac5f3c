"""``gensig run-up``: vibration over the speed, of variants of a machine."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import FloatArray
from gensig.commands.console import remark, step
from gensig.commands.figures.variants_figure import variants_figure
from gensig.commands.gears.run_up import (
    ACCELERATION_REFERENCE,
    HARMONICS,
    RPM,
    is_steady,
    refusals,
    shaft_angle,
)
from gensig.commands.gears.simulate import configured_row
from gensig.commands.output import Answer, answered
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request
from gensig.record.simulate import Record, simulate_record
from gensig.signals.run_up.level_map import decibels
from gensig.signals.run_up.speed_maps import LEAST_CHANGE, order_map
from gensig.systems.base import Machine
from gensig.units import channel_unit

FIRST = "as configured"
UNIT = "m/s^2"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vibration:
    """RMS over the speed, the root of the mean square of all acceleration channels.

    Attributes
    ----------
    speed : (speed,) rad/s    of the pinion
    total : (speed,) m/s2     of all orders
    mesh : (speed,) m/s2      of the mesh and its harmonics, `HARMONICS` in all
    """

    speed: FloatArray
    total: FloatArray
    mesh: FloatArray

    def at(self, speed: FloatArray) -> Vibration:
        """The same at other speeds, by straight lines; NaN beyond its ends."""
        total, mesh = (
            np.interp(speed, self.speed, values, np.nan, np.nan)
            for values in (self.total, self.mesh)
        )
        return Vibration(speed=speed, total=total, mesh=mesh)


@answered()
def run_up(config: Configuration, arguments: Namespace) -> Answer | int:
    """The vibration of the variants over the speed, and its mean change."""
    configs = {FIRST: config}
    for each in arguments.against:
        words = [*arguments.overrides, each]
        configs[each] = read_request(words, config_dir=arguments.config_dir).config
    variants: dict[str, Vibration] = {}
    for name, config in configs.items():
        step(f"run-up of {name}")
        reader, row = configured_row(config)
        record = simulate_record(reader, row)
        if record.values.get("status") == "failed":
            remark(f"{name}: {record.values['status_reason']}")
            return 1
        variants[name] = _vibration(reader.machine(), record)
    speed = variants[FIRST].speed
    variants = {name: each.at(speed) for name, each in variants.items()}
    content = _content(variants)
    return Answer(content, _changes(content), lambda: variants_figure(content))


def _vibration(machine: Machine, record: Record) -> Vibration:
    """Vibration of one record; ConfigError where it is no run-up."""
    channels = _acceleration_channels(machine)
    angle = None
    if "shaft_speed" in record.signals:
        angle = shaft_angle(machine, record)
    if angle is None or is_steady(angle):
        raise ConfigError(
            f"the speed changes by {100.0 * LEAST_CHANGE:g} % or less; give a course in "
            "operating.speed_profile, for instance operating=ramp"
        )
    signal = record.signals["acceleration"][channels].astype(np.float64)
    n_teeth = machine.pair.pinion.n_teeth
    with refusals():
        orders = order_map(signal, angle, machine.sensing.sampling_rate)
    orders = orders.up_to((HARMONICS + 1) * n_teeth).by_speed()
    mesh = [
        np.nan_to_num(np.square(orders.at(harmonic * n_teeth)))
        for harmonic in range(1, HARMONICS + 1)
    ]
    known = np.isfinite(orders.total[0])
    return Vibration(
        speed=orders.speed[known],
        total=np.sqrt(np.mean(np.square(orders.total), axis=0))[known],
        mesh=np.sqrt(np.mean(np.sum(mesh, axis=0), axis=0))[known],
    )


def _acceleration_channels(machine: Machine) -> list[int]:
    """Indices of the channels in m/s2; ConfigError where there are none."""
    names = machine.sensing.channel_names
    found = [index for index, name in enumerate(names) if channel_unit(name) == UNIT]
    if not found:
        raise ConfigError(
            f"sensing.channels {', '.join(names)}: run-ups are compared by accelerations in m/s2; "
            "add one, for instance pinion_y"
        )
    return found


def _content(variants: dict[str, Vibration]) -> dict[str, Any]:
    """The keys of ``gensig run-up --json``; levels and changes by variant."""
    first = variants[FIRST]
    parts = {
        part: {name: getattr(each, part) for name, each in variants.items()}
        for part in ("total", "mesh")
    }
    content: dict[str, Any] = {"speeds_rpm": RPM * first.speed, "harmonics": HARMONICS}
    for part, rows in parts.items():
        content[f"{part}_rms_m_per_s2"] = rows
        content[f"{part}_level_db"] = {
            name: decibels(row, ACCELERATION_REFERENCE) for name, row in rows.items()
        }
        content[f"{part}_change_db"] = {
            name: 20.0 * np.log10(row / rows[FIRST])
            for name, row in rows.items()
            if name != FIRST
        }
    return content


def _changes(content: dict[str, Any]) -> Iterator[str]:
    """The mean change of every variant over the speed."""
    rpm = content["speeds_rpm"]
    yield f"run-up, {rpm[0]:.0f} to {rpm[-1]:.0f} r/min, RMS against {FIRST}:"
    for name, total in content["total_change_db"].items():
        mesh = content["mesh_change_db"][name]
        yield (
            f"  {name}: {np.nanmean(total):+.2f} dB on average, {np.nanmin(total):+.2f} to "
            f"{np.nanmax(total):+.2f}; mesh orders {np.nanmean(mesh):+.2f} dB"
        )
