"""``gensig simulate``: one record of a configuration or of a data set."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.console import note, remark, replaced_file
from gensig.commands.figures.machine_figures import record_figure, record_name
from gensig.commands.figures.panels import draw
from gensig.commands.figures.run_up_figure import run_up_figure
from gensig.commands.gears.run_up import (
    RunUp,
    print_run_up,
    read_run_up,
    with_traces,
    write_levels,
)
from gensig.commands.output import FIGURE_TYPES, check_file, check_new
from gensig.errors import ConfigError, SimulationError
from gensig.faults.registry import without_vary
from gensig.life.life_options import NO_LIFE
from gensig.options.configuration import Configuration
from gensig.plan.doubts import plan_doubts
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.production.reproduction import recorded_row, simulate_twin
from gensig.production.shard_writing import open_shard
from gensig.record.inputs import InputReader
from gensig.record.options import AS_GIVEN, CROSSED
from gensig.record.simulate import Record, simulate_record
from gensig.signals.indicators import crest_factor, kurtosis, rms
from gensig.signals.run_up.speed_maps import LEAST_CHANGE
from gensig.systems.base import Machine
from gensig.terminal.printing import show
from gensig.text.csv_tables import header_line
from gensig.units import channel_unit

RECORD_TYPES = (".h5", ".hdf5", ".csv")
TABLE_TYPES = (".csv",)


def simulate(arguments: Namespace) -> int:
    """Simulate one record as ``generate`` does, write and draw it, and print its levels.

    Every value is as configured rather than drawn.
    """
    check_file("--plot", arguments.plot, FIGURE_TYPES)
    check_file("--output", arguments.output, RECORD_TYPES)
    check_file("--orders", arguments.orders, TABLE_TYPES)
    check_new("--output", arguments.output, force=arguments.force)
    if arguments.folder is not None:
        return _simulate_recorded(arguments)
    if arguments.record is not None or arguments.twin:
        raise ConfigError(
            "--record and --twin are of a data set; give it with --from DIR"
        )
    config = read_request(arguments.overrides, config_dir=arguments.config_dir).config
    reader, row = configured_row(config)
    return _show(reader, row, simulate_record(reader, row), arguments)


def configured_row(config: Configuration) -> tuple[InputReader, Mapping[str, Any]]:
    """The reader of one record with traces, and its row of the plan.

    Every value is as configured rather than drawn.
    """
    name = config["fault"]["kind"]
    config = config.with_keys(
        "plan",
        n_records=1,
        n_units=1,
        n_gearboxes=1,
        machines=CROSSED,
        fault_gear=AS_GIVEN,
        n_reference=0,
        conditions_per_unit=None,
        n_repeats=1,
        classes=[name],
        design="latin_hypercube",
        vary={},
    )
    config = config.with_entries(
        classes={name: without_vary(config["fault"])}, life={"kind": NO_LIFE}
    )
    plan = make_plan(config)
    reader = InputReader(config)
    note(*plan_doubts(reader, plan))
    return with_traces(reader), plan.record(0)


def _simulate_recorded(arguments: Namespace) -> int:
    """Simulate a record of a data set anew, or with --twin the same without its faults."""
    if arguments.overrides or arguments.config_dir:
        raise ConfigError(
            "--from takes everything from the data set; "
            "give no overrides and no --config-dir with it"
        )
    if arguments.record is None:
        raise ConfigError("--from needs --record I, the number or id of a record")
    reader, row = recorded_row(Path(arguments.folder), arguments.record)
    reader = with_traces(reader)
    if not arguments.twin:
        return _show(reader, row, simulate_record(reader, row), arguments)
    name = f"healthy twin of {row['record_id']} ({row['label_name']})"
    return _show(reader, row, simulate_twin(reader, row), arguments, name)


def _show(
    reader: InputReader,
    row: Mapping[str, Any],
    record: Record,
    arguments: Namespace,
    name: str | None = None,
) -> int:
    """Write, draw and print one record of `with_traces`, and its row.

    A record without a name has its class and severity.
    """
    values, acceleration = record.values, record.signals.get("acceleration")
    if values.get("status") == "failed" or acceleration is None:
        remark(f"{values['status_reason']}")
        return 1
    system = reader.machine()
    run_up = _run_up(system, record, arguments)
    if arguments.output:
        with replaced_file(arguments.output) as path:
            if path.suffix == ".csv":
                _write_csv(system, acceleration, path)
            else:
                _write_shard(reader, record, path)
    if arguments.plot:
        if run_up is None:
            sound = _without_fault(reader, row, record)
            figure = record_figure(system, acceleration, values, name=name, sound=sound)
        else:
            figure = run_up_figure(run_up, record_name(values, name))
        with replaced_file(arguments.plot) as path:
            draw(figure, path)
    if arguments.orders and run_up is not None:
        with replaced_file(arguments.orders) as path:
            write_levels(run_up, path)
    show(name or f"class {values['label_name']}, severity {values['severity']:.3f}")
    speed, mesh = values["speed_rpm"], values["mesh_frequency_hz"]
    show(f"speed {speed:.3f} r/min, mesh frequency {mesh:.2f} Hz")
    _print_levels(system, acceleration)
    if run_up is not None:
        print_run_up(run_up)
    return 0


def _without_fault(
    reader: InputReader, row: Mapping[str, Any], record: Record
) -> np.ndarray | None:
    """Acceleration of the same record of the healthy machine, (channel, sample).

    None where the record has no fault, and where the healthy machine makes no record.
    """
    if record.values["faults_json"] == "[]":
        return None
    try:
        return simulate_twin(reader, row).signals["acceleration"]
    except SimulationError:
        return None


def _run_up(system: Machine, record: Record, arguments: Namespace) -> RunUp | None:
    """Levels over the speed of a record where a figure or a table asks for them.

    None where the speed hardly changes. ``--orders`` needs them; a figure without them is that of
    a constant speed.
    """
    if not (arguments.plot or arguments.orders):
        return None
    try:
        run_up = read_run_up(system, record)
    except ConfigError as error:
        if arguments.orders:
            raise
        remark(f"{error}; the figure is that of a constant speed")
        return None
    if arguments.orders and run_up is None:
        raise ConfigError(
            f"--orders {arguments.orders}: the speed changes by {100.0 * LEAST_CHANGE:g} % or "
            "less; give a course in operating.speed_profile, for instance operating=ramp"
        )
    return run_up


def _write_shard(reader: InputReader, record: Record, path: Path) -> None:
    """Write one record as a shard of one row."""
    params = [
        name.removeprefix("params/")
        for name in record.values
        if name.startswith("params/")
    ]
    with open_shard(path, reader, 1, params) as writer:
        writer.write(0, record.signals, record.values)


def _write_csv(system: Machine, acceleration: np.ndarray, path: Path) -> None:
    """Write one record as a table of time and channels."""
    header = ["time_s"]
    for name in system.sensing.channel_names:
        unit = channel_unit(name).replace("/", "_per_").replace("^", "")
        header.append(f"{name}_{unit}")
    time = np.arange(acceleration.shape[1]) / system.sensing.sampling_rate
    table = np.column_stack([time, *acceleration])
    np.savetxt(path, table, "%.9g", ",", header=header_line(header), comments="")


def _print_levels(system: Machine, acceleration: np.ndarray) -> None:
    show(f"{'channel':<16}{'RMS':>12} {'':<8}{'kurtosis':>12}{'crest':>12}")
    table = zip(
        system.sensing.channel_names,
        rms(acceleration),
        kurtosis(acceleration),
        crest_factor(acceleration),
        strict=True,
    )
    for name, level, fourth, crest in table:
        unit = channel_unit(name).replace("^", "")
        show(f"{name:<16}{level:>12.4g} {unit:<8}{fourth:>12.3f}{crest:>12.3f}")
