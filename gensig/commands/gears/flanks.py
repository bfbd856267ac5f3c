"""Verbs on the loaded flanks of a pair, slice by slice.

Transmission-error, and stiffness of a helical pair.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.console import one_line_warnings
from gensig.commands.gears.heat_report import heat_content, heat_report, print_heat
from gensig.commands.output import check_outputs, highest, write_outputs
from gensig.commands.request import read_configuration
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.options.configuration import Configuration
from gensig.systems.registry import read_sliced_pair
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

LOST_SHARE = 0.02  # of the bearing field; less is the edge of the reliefs
LEAST_SHARE = (
    0.05  # of the highest stiffness of a pair; less is one slice that enters or leaves
)


def transmission_error(arguments: Namespace) -> int:
    """Static transmission error under load over one mesh period: JSON, a figure, or a summary."""
    check_outputs(arguments)
    config = read_configuration(arguments)
    with one_line_warnings("gensig"):
        system, faults = read_sliced_pair(config), read_faults(config["fault"])
        sound = system.transmission_error()
        result = system.transmission_error(faults) if faults else sound
        _warn_of_lost_contact(system, sound)
    content = transmission_error_content(system, result)
    if faults:
        content["fault_adds_um"] = added_um(sound, result)

    def draw(path: Path) -> None:
        from gensig.commands.figures.flank_figures import plot_transmission_error

        plot_transmission_error(system, result, path)

    write_outputs(arguments, content, draw)
    print(f"contact ratio              {content['transverse_contact_ratio']:.4f} transverse, "
          f"{content['overlap_ratio']:.4f} overlap, {content['total_contact_ratio']:.4f} total")  # fmt: skip
    print(f"transmission error, mean   {content['mean_um']:.4f} um")
    print(f"peak to peak               {content['peak_to_peak_um']:.4f} um")
    orders = ", ".join(f"{value:.4f}" for value in content["harmonics_um"][:4])
    print(f"mesh orders 1 to 4         {orders} um")
    print(f"largest line load          {content['max_line_load_n_per_mm']:.2f} N/mm")
    print(f"largest contact pressure   {content['max_contact_pressure_mpa']:.1f} MPa")
    if faults:
        print(
            f"mesh periods               {result.n_periods}, the first faulty tooth enters at roll 0"
        )
        print(f"the fault adds             {_span(content['fault_adds_um'], '.4g')} um")
    return 0


def added_um(sound: TransmissionError, faulty: TransmissionError) -> list[float]:
    """How much more the gears approach with a fault than without, um.

    ``sound`` is of one mesh period.
    """
    return ((faulty.error - np.tile(sound.error, faulty.n_periods)) * 1e6).tolist()


def _span(values: list[float], form: str) -> str:
    """Least and greatest value; what is 0 up to rounding has no sign."""
    low, high = (
        0.0 if abs(value) < 1e-9 else value for value in (min(values), max(values))
    )
    return f"{low:{form}} .. {high:{form}}"


def transmission_error_content(
    system: SlicedPair, result: TransmissionError
) -> dict[str, Any]:
    """The keys of ``gensig transmission-error --json``."""
    pair, error = system.pair, result.error
    return {
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "total_contact_ratio": pair.total_contact_ratio,
        "center_distance_mm": pair.center_distance * 1e3,
        "mesh_force_n": system.mesh_force,
        "roll_angle_deg": np.degrees(
            result.contact.roll / pair.pinion.base_radius
        ).tolist(),
        "transmission_error_um": (error * 1e6).tolist(),
        "mesh_periods": result.n_periods,
        "mean_um": float(error.mean()) * 1e6,
        "peak_to_peak_um": float(np.ptp(error)) * 1e6,
        "harmonics_um": (result.harmonics * 1e6).tolist(),
        "mesh_stiffness_n_per_m": result.contact.stiffness.tolist(),
        "max_line_load_n_per_mm": float(result.contact.line_load.max()) * 1e-3,
        "max_contact_pressure_mpa": float(result.pressure.max()) * 1e-6,
        "load_share": result.load_share.tolist(),
        "pair_index": result.contact.pair_index.tolist(),
        "bearing_share_of_field": result.bearing,
        "slice_place_mm": (result.slice_place * 1e3).tolist(),
        "line_load_n_per_mm": (result.contact.line_load * 1e-3).tolist(),
        "contact_position": (result.contact.position / pair.base_pitch).tolist(),
    }


def sliced_stiffness(config: Configuration, arguments: Namespace) -> int:
    """``gensig stiffness`` of a pair cut into slices: curves to JSON, a figure, or a summary."""
    with one_line_warnings("gensig"):
        system, faults = read_sliced_pair(config), read_faults(config["fault"])
        sound = system.transmission_error()
        result = system.transmission_error(faults) if faults else sound
        position, single = system.single_pair()
        faulty = system.faulty_pair(faults, position) if faults else None
        hot = heat_report(config)
    stiffness = result.contact.stiffness
    content = {
        "transverse_contact_ratio": system.pair.transverse_contact_ratio,
        "overlap_ratio": system.pair.overlap_ratio,
        "total_contact_ratio": system.pair.total_contact_ratio,
        "base_pitch_mm": system.pair.base_pitch * 1e3,
        "contact_position": (position / system.pair.base_pitch).tolist(),
        "single_pair_stiffness_n_per_m": single.tolist(),
        "roll_angle_deg": np.degrees(
            result.contact.roll / system.pair.pinion.base_radius
        ).tolist(),
        "mesh_stiffness_n_per_m": stiffness.tolist(),
        "mesh_stiffness_mean_n_per_m": float(stiffness.mean()),
        "mesh_stiffness_kind": "dF/d(approach) at static equilibrium, contact term as a secant",
        "mesh_periods": result.n_periods,
    }
    if faulty is not None:
        content["faulty_pair_stiffness_n_per_m"] = faulty.tolist()
        content["sound_mesh_stiffness_n_per_m"] = sound.contact.stiffness.tolist()
    if hot is not None:
        content["heat"] = heat_content(hot)

    def draw(path: Path) -> None:
        from gensig.commands.figures.flank_figures import plot_sliced_stiffness
        from gensig.commands.figures.heat_figures import plot_heat

        if hot is None:
            plot_sliced_stiffness(
                system, result, position, single, path, faulty=faulty, sound=sound
            )
        else:
            plot_heat(hot, path)

    write_outputs(arguments, content, draw)
    print(f"contact ratio              {system.pair.transverse_contact_ratio:.4f} transverse, "
          f"{system.pair.overlap_ratio:.4f} overlap, {system.pair.total_contact_ratio:.4f} total")  # fmt: skip
    print(f"mesh stiffness, mean       {stiffness.mean():.4e} N/m")
    print(
        f"mesh stiffness, range      {stiffness.min():.4e} .. {stiffness.max():.4e} N/m"
    )
    print(f"single pair, highest       {highest(single, faulty)}")
    if faulty is not None:
        lost = 1e2 * (
            1.0 - stiffness / np.tile(sound.contact.stiffness, result.n_periods)
        )
        print(
            f"mesh periods               {result.n_periods}, the first faulty tooth enters at roll 0"
        )
        print(f"the mesh loses             {_span(lost.tolist(), '.3g')} %")
        near = single > LEAST_SHARE * single.max()
        loss = 1e2 * (1.0 - faulty[near] / single[near])
        print(f"faulty pair loses          {_span(loss.tolist(), '.3g')} %")
    if hot is not None:
        print_heat(hot)
    return 0


def sound_pair(config: Configuration) -> SlicedPair:
    """The pair of a configuration, for those who look at sound flanks only."""
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: a modification is for sound flanks; take fault=healthy, and gensig "
            f"transmission-error with that modification and the fault"
        )
    return read_sliced_pair(config)


def _warn_of_lost_contact(system: SlicedPair, result: TransmissionError) -> None:
    """Say how much of the field of action a modification takes out of contact."""
    lost = 1.0 - result.bearing
    if (system.modification.is_any or system.growth is not None) and lost > LOST_SHARE:
        print(
            f"gensig: WARNING: {lost:.0%} of the field of action carry no load: the modification, the misalignment or "
            f"the unequal growth of hot gears is deeper than {system.torque:g} N m can close",
            file=sys.stderr,
        )
