"""Verbs on one machine: stiffness, simulate."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.console import replaced_file
from gensig.commands.output import (
    FIGURE_TYPES,
    check_file,
    check_new,
    check_outputs,
    highest,
    write_outputs,
)
from gensig.commands.request import read_configuration
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults, without_vary
from gensig.mesh.pair_table import PairTable
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.systems.base import Machine
from gensig.systems.registry import SLICED
from gensig.systems.spur_pair import SpurPair
from gensig.systems.stiffness_curves import StiffnessCurves
from gensig.units import channel_unit

if TYPE_CHECKING:
    from gensig.record.simulate import Record

Array = NDArray[np.float64]


RECORD_TYPES = (".h5", ".hdf5", ".csv")


def stiffness(arguments: Namespace) -> int:
    """Mesh stiffness of a gear pair: curves to JSON, a figure, or a summary."""
    check_outputs(arguments)
    config = read_configuration(arguments)
    if config["system"].get("kind") == SLICED:
        from gensig.commands.gears.flanks import sliced_stiffness

        return sliced_stiffness(config, arguments)
    system = read_machine(config)
    faults = read_faults(config["fault"])
    curves = system.stiffness_curves(faults)
    if system.pair.transverse_contact_ratio < 1.0:
        print(
            f"gensig: WARNING: the transverse contact ratio {system.pair.transverse_contact_ratio:.4f} is below 1: the "
            f"drive is interrupted at every tooth; these curves are quasi-static",
            file=sys.stderr,
        )
    content = stiffness_content(system, curves)

    def draw(path: Path) -> None:
        from gensig.commands.figures.machine_figures import plot_stiffness

        plot_stiffness(
            system,
            curves,
            faults,
            path,
            sound=system.stiffness_curves() if faults else curves,
        )

    write_outputs(arguments, content, draw)
    _print_stiffness(content, curves)
    return 0


def stiffness_content(system: Machine, curves: StiffnessCurves) -> dict[str, Any]:
    """The keys of ``gensig stiffness --json``."""
    table = system.mesh_table()
    assert isinstance(table, PairTable)  # which the curves are made of
    content: dict[str, Any] = {
        "transverse_contact_ratio": system.pair.transverse_contact_ratio,
        "base_pitch_mm": system.pair.base_pitch * 1e3,
        "contact_position": curves.contact_position.tolist(),
        "single_pair_stiffness_n_per_m": curves.single_pair_stiffness.tolist(),
        "roll_angle_deg": np.degrees(curves.roll_angle).tolist(),
        "mesh_stiffness_n_per_m": curves.mesh_stiffness.tolist(),
        "mesh_stiffness_mean_n_per_m": float(curves.mesh_stiffness.mean()),
        "mesh_stiffness_kind": "sum of pair stiffnesses (secant)"
        if system.mesh.law == "paper"
        else "tangent dF/d(approach) at static equilibrium",
        "compliance_m_per_n": {
            gear: {name: values.tolist() for name, values in terms.items()}
            for gear, terms in curves.compliance.items()
        },
        "shared_body_compliance_m_per_n": table.shared_compliance,
    }
    if (
        isinstance(system, SpurPair)
        and system.mesh.law != "paper"
        and 1.0 <= system.pair.transverse_contact_ratio < 2.0
    ):
        relief = system.long_relief()
        content["long_tip_relief"] = {
            name: {
                "tip_relief_um": side.tip_relief * 1e6,
                "tip_relief_height_mm": side.tip_relief_height * 1e3,
            }
            for name, side in (("pinion", relief.pinion), ("wheel", relief.wheel))
        }
    if curves.faulty_pair_stiffness is not None and curves.faulty_pair_gap is not None:
        content["faulty_pair_stiffness_n_per_m"] = curves.faulty_pair_stiffness.tolist()
        content["faulty_pair_gap_um"] = (curves.faulty_pair_gap * 1e6).tolist()
    return content


def _print_stiffness(content: dict[str, Any], curves: StiffnessCurves) -> None:
    print(f"transverse contact ratio   {content['transverse_contact_ratio']:.5f}")
    print(f"base pitch                 {content['base_pitch_mm']:.5f} mm")
    print(
        f"mesh stiffness, mean       {content['mesh_stiffness_mean_n_per_m']:.4e} N/m"
    )
    print(
        f"mesh stiffness, range      {curves.mesh_stiffness.min():.4e} .. {curves.mesh_stiffness.max():.4e} N/m"
    )
    print(
        f"single pair, highest       {highest(curves.single_pair_stiffness, curves.faulty_pair_stiffness)}"
    )
    if (relief := content.get("long_tip_relief")) is not None:
        sides = (
            f"{name} {side['tip_relief_um']:.2f} um over {side['tip_relief_height_mm']:.2f} mm"
            for name, side in relief.items()
        )
        print(f"tip relief for this torque {', '.join(sides)} of height")
    if curves.faulty_pair_stiffness is not None:
        loss = 1e2 * (1.0 - curves.faulty_pair_stiffness / curves.single_pair_stiffness)
        gap = np.array(content["faulty_pair_gap_um"])
        print(f"faulty pair loses          {_range(loss, '.2f')} %")
        print(f"faulty pair touches later  {_range(gap, '.3g')} um")


def _range(values: Array, form: str) -> str:
    """Least and greatest value; what is 0 up to rounding has no sign."""
    low, high = (
        0.0 if abs(value) < 1e-9 else value for value in (values.min(), values.max())
    )
    return f"{low:{form}} .. {high:{form}}"


def simulate(arguments: Namespace) -> int:
    """One record, as ``generate`` would make it, with every value as configured rather than
    drawn.
    """
    from gensig.plan.make import make_plan
    from gensig.record.simulate import simulate_record

    check_file("--plot", arguments.plot, FIGURE_TYPES)
    check_file("--output", arguments.output, RECORD_TYPES)
    check_new("--output", arguments.output, force=arguments.force)
    if arguments.folder is not None:
        return _simulate_again(arguments)
    if arguments.record is not None or arguments.twin:
        raise ConfigError(
            "--record and --twin are of a data set; give it with --from DIR"
        )
    request = read_request(arguments.overrides, config_dir=arguments.config_dir)
    config = request.config
    name = config["fault"]["kind"]
    one: dict[str, Any] = {
        "n_records": 1,
        "n_units": 1,
        "n_gearboxes": 1,
        "conditions_per_unit": None,
        "n_repeats": 1,
    }
    config = config.with_keys(
        "plan", **one, classes=[name], design="latin_hypercube", vary={}
    )
    config = config.with_entries(classes={name: without_vary(config["fault"])})
    row = make_plan(config).record(0)
    return _show(config, simulate_record(config, row), arguments)


def _simulate_again(arguments: Namespace) -> int:
    """A record of a data set made again, or with --twin without its faults."""
    from gensig.production.reproduction import recorded_row, simulate_twin
    from gensig.record.simulate import simulate_record

    if arguments.overrides or arguments.config_dir:
        raise ConfigError(
            "--from takes everything from the data set; give no overrides and no --config-dir with it"
        )
    if arguments.record is None:
        raise ConfigError("--from needs --record I, the number or id of a record")
    config, row = recorded_row(Path(arguments.folder), arguments.record)
    record = (
        simulate_twin(config, row) if arguments.twin else simulate_record(config, row)
    )
    name = (
        f"healthy twin of {row['record_id']} ({row['label_name']})"
        if arguments.twin
        else None
    )
    return _show(config, record, arguments, name)


def _show(
    config: Configuration, record: Record, arguments: Namespace, name: str | None = None
) -> int:
    """Write, plot and describe one record, by its class and severity where it has no other name."""
    if record.values.get("status") == "failed":
        print(f"gensig: {record.values['status_reason']}", file=sys.stderr)
        return 1
    system = read_machine(config)
    if arguments.output:
        _write_record(config, system, record, arguments.output)
    if arguments.plot:
        from gensig.commands.figures.machine_figures import plot_record

        with replaced_file(arguments.plot) as path:
            plot_record(
                system, record.signals["acceleration"], record.values, path, name=name
            )
    print(
        name
        or f"class {record.values['label_name']}, severity {record.values['severity']:.3f}"
    )
    _print_record(system, record.signals["acceleration"], record.values)
    return 0


def _write_record(
    config: Configuration, system: Machine, record: Record, output: str
) -> None:
    """One record as a shard of one row, or as a table with time and channels."""
    path = Path(output)
    if path.suffix != ".csv":
        from gensig.production.folder import open_shard

        params = [
            name.removeprefix("params/")
            for name in record.values
            if name.startswith("params/")
        ]
        with (
            replaced_file(path) as temporary,
            open_shard(temporary, config, 1, params) as writer,
        ):
            writer.write(0, record.signals, record.values)
    else:
        acceleration = record.signals["acceleration"]
        time = np.arange(acceleration.shape[1]) / system.sensing.sampling_rate
        units = (
            channel_unit(name).replace("/", "_per_").replace("^", "")
            for name in system.sensing.channel_names
        )
        names = (
            f"{name}_{unit}"
            for name, unit in zip(system.sensing.channel_names, units, strict=True)
        )
        header = ",".join(["time_s", *names])
        with replaced_file(path) as temporary:
            np.savetxt(
                temporary,
                np.column_stack([time, *acceleration]),
                "%.9g",
                ",",
                header=header,
                comments="",
            )


def _print_record(
    system: Machine, acceleration: NDArray[np.float32], values: dict[str, Any]
) -> None:
    from gensig.signals.indicators import crest_factor, kurtosis, rms

    print(
        f"speed {values['speed_rpm']:.3f} r/min, mesh frequency {values['mesh_frequency_hz']:.2f} Hz"
    )
    print(f"{'channel':<16}{'RMS':>12} {'':<8}{'kurtosis':>12}{'crest':>12}")
    table = zip(
        system.sensing.channel_names,
        rms(acceleration),
        kurtosis(acceleration),
        crest_factor(acceleration),
        strict=True,
    )
    for name, level, fourth, crest in table:
        unit = channel_unit(name).replace("^", "")
        print(f"{name:<16}{level:>12.4g} {unit:<8}{fourth:>12.3f}{crest:>12.3f}")
