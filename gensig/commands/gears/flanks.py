"""Verbs on the loaded flanks of a pair, slice by slice.

``gensig transmission-error``, and ``gensig stiffness`` of a pair cut into slices.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.console import remark
from gensig.commands.figures.flank_figures import (
    sliced_stiffness_figure,
    transmission_error_figure,
)
from gensig.commands.figures.heat_figures import heat_figure
from gensig.commands.figures.panels import Figure
from gensig.commands.gears.heat_report import heat_content, heat_lines, heat_report
from gensig.commands.output import Answer, answered, highest, span
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.geometry.contact import GearPair
from gensig.mesh.options import MOST_SLICES
from gensig.options.configuration import Configuration
from gensig.systems.registry import PairParts, read_sliced_pair
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

TOLERATED = 0.01  # error of a pressure that is not told
LOST_SHARE = 0.02  # of the bearing field; less is the edge of the reliefs
# Of the highest stiffness of a pair; less is one slice that enters or leaves.
LEAST_SHARE = 0.05


@answered()
def transmission_error(config: Configuration, _: Namespace) -> Answer:
    """Static transmission error under load."""
    system, faults = read_sliced_pair(config), read_faults(config["fault"])
    result = sound = system.transmission_error()
    if faults:
        result = system.transmission_error(faults)
    _warn_of_lost_contact(system, sound)
    pressure_error = system.pressure_error(sound)
    content = transmission_error_content(system, result)
    content["max_contact_pressure_error"] = pressure_error
    if faults:
        content["fault_adds_um"] = added_um(sound, result)
    return Answer(
        content,
        _lines(system, result, content),
        lambda: transmission_error_figure(system, result),
    )


def _lines(
    system: SlicedPair, result: TransmissionError, content: Mapping[str, Any]
) -> Iterator[str]:
    pressure_error = content["max_contact_pressure_error"]
    yield _contact_ratios(system.pair)
    orders = ", ".join(f"{value:.4f}" for value in content["harmonics_um"][:4])
    yield f"transmission error, mean   {content['mean_um']:.4f} um"
    yield f"peak to peak               {content['peak_to_peak_um']:.4f} um"
    yield f"mesh orders 1 to 4         {orders} um"
    yield f"largest line load          {content['max_line_load_n_per_mm']:.2f} N/mm"
    pressure = f"{content['max_contact_pressure_mpa']:.1f} MPa"
    yield f"largest contact pressure   {pressure}{_with_error(system, pressure_error)}"
    if "fault_adds_um" in content:
        yield _periods(result)
        yield f"the fault adds             {span(content['fault_adds_um'], '.4g')} um"


def _with_error(system: SlicedPair, error: float) -> str:
    """Remark on a pressure whose slices are too wide for it."""
    n_slices = system.slices.n_slices
    if error <= TOLERATED:
        return ""
    if not error > TOLERATED:
        return f", error unknown with {n_slices} slice"
    remark = f", within about {error:.0%} with {n_slices} slices"
    if 2 * n_slices > MOST_SLICES:
        return remark
    return f"{remark}; mesh.n_slices={min(4 * n_slices, MOST_SLICES)} is nearer"


def added_um(sound: TransmissionError, faulty: TransmissionError) -> NDArray[Any]:
    """Approach of the gears that a fault adds, um; ``sound`` is of one mesh period."""
    return (faulty.error - np.tile(sound.error, faulty.n_periods)) * 1e6


def transmission_error_content(
    system: SlicedPair, result: TransmissionError
) -> dict[str, Any]:
    """The keys of ``gensig transmission-error --json``."""
    pair, error, contact = system.pair, result.error, result.contact
    return {
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "total_contact_ratio": pair.total_contact_ratio,
        "center_distance_mm": pair.center_distance * 1e3,
        "mesh_force_n": system.mesh_force,
        "roll_angle_deg": np.degrees(contact.roll / pair.pinion.base_radius),
        "transmission_error_um": error * 1e6,
        "mesh_periods": result.n_periods,
        "mean_um": error.mean() * 1e6,
        "peak_to_peak_um": np.ptp(error) * 1e6,
        "harmonics_um": result.harmonics * 1e6,
        "mesh_stiffness_n_per_m": contact.stiffness,
        "max_line_load_n_per_mm": contact.line_load.max() * 1e-3,
        "max_contact_pressure_mpa": result.pressure.max() * 1e-6,
        "load_share": result.load_share,
        "pair_index": contact.pair_index,
        "bearing_share_of_field": result.bearing,
        "slice_place_mm": result.slice_middle * 1e3,
        "line_load_n_per_mm": contact.line_load * 1e-3,
        "contact_position": contact.position / pair.base_pitch,
    }


def sliced_stiffness(parts: PairParts, fault: Mapping[str, Any]) -> Answer:
    """``gensig stiffness`` of a pair cut into slices."""
    faulty = None
    system, faults = parts.flanks, read_faults(fault)
    result = sound = system.transmission_error()
    position, single = system.single_pair()
    if faults:
        result = system.transmission_error(faults)
        faulty = system.faulty_pair(faults, position)
    hot = heat_report(parts.duty)
    pair, contact = system.pair, result.contact
    stiffness = contact.stiffness
    content = {
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "total_contact_ratio": pair.total_contact_ratio,
        "base_pitch_mm": pair.base_pitch * 1e3,
        "contact_position": position / pair.base_pitch,
        "single_pair_stiffness_n_per_m": single,
        "roll_angle_deg": np.degrees(contact.roll / pair.pinion.base_radius),
        "mesh_stiffness_n_per_m": stiffness,
        "mesh_stiffness_mean_n_per_m": stiffness.mean(),
        "mesh_stiffness_kind": "dF/d(approach) at static equilibrium, contact term as a secant",
        "mesh_periods": result.n_periods,
    }
    if faulty is not None:
        content["faulty_pair_stiffness_n_per_m"] = faulty
        content["sound_mesh_stiffness_n_per_m"] = sound.contact.stiffness
    if hot is not None:
        content["heat"] = heat_content(hot)

    def figure() -> Figure:
        if hot is not None:
            return heat_figure(hot)
        return sliced_stiffness_figure(
            system, result, position, single, faulty=faulty, sound=sound
        )

    lines = [*_stiffness_lines(pair, single, faulty, result, sound)]
    if hot is not None:
        lines += heat_lines(hot)
    return Answer(content, lines, figure)


def _stiffness_lines(
    pair: GearPair,
    single: NDArray[Any],
    faulty: NDArray[Any] | None,
    result: TransmissionError,
    sound: TransmissionError,
) -> Iterator[str]:
    stiffness = result.contact.stiffness
    low, high = stiffness.min(), stiffness.max()
    yield _contact_ratios(pair)
    yield f"mesh stiffness, mean       {stiffness.mean():.4e} N/m"
    yield f"mesh stiffness, range      {low:.4e} .. {high:.4e} N/m"
    yield f"single pair, highest       {highest(single, faulty)}"
    if faulty is not None:
        without = np.tile(sound.contact.stiffness, result.n_periods)
        lost = 1e2 * (1.0 - stiffness / without)
        near = single > LEAST_SHARE * single.max()
        pair_lost = 1e2 * (1.0 - faulty[near] / single[near])
        yield _periods(result)
        yield f"the mesh loses             {span(lost, '.3g')} %"
        yield f"faulty pair loses          {span(pair_lost, '.3g')} %"


def sound_pair(parts: PairParts, fault: Mapping[str, Any]) -> SlicedPair:
    """The pair, which must be without a fault."""
    if read_faults(fault):
        raise ConfigError(
            f"fault={fault['kind']}: a modification is for healthy flanks; "
            "take fault=healthy, and gensig transmission-error "
            "with that modification and the fault"
        )
    return parts.flanks


def _contact_ratios(pair: GearPair) -> str:
    return (
        f"contact ratio              {pair.transverse_contact_ratio:.4f} transverse, "
        f"{pair.overlap_ratio:.4f} overlap, {pair.total_contact_ratio:.4f} total"
    )


def _periods(result: TransmissionError) -> str:
    return (
        f"mesh periods               {result.n_periods}, "
        "the first faulty tooth enters at roll 0"
    )


def _warn_of_lost_contact(system: SlicedPair, result: TransmissionError) -> None:
    """Print a warning where a modification takes much of the field out of contact."""
    lost = 1.0 - result.bearing
    if (system.modification.is_any or system.growth is not None) and lost > LOST_SHARE:
        remark(
            f"WARNING: {lost:.0%} of the field of action carry no load: the modification, "
            "the misalignment or the unequal growth of hot gears is deeper than "
            f"{system.torque:g} N m can close"
        )
