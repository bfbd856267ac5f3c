"""``diagnose detectability``."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from diagnose.commands.parser import add_overrides
from gensig.errors import ConfigError
from gensig.terminal.printing import remark, show
from gensig.terminal.warning_lines import one_line_warnings

HELP = """\
Which test shows the fault? Maps over speed, torque, channel and bandwidth, without any training.

Machines of the same build are simulated with and without the selected fault, everything as
configured. One observer knows what the fault adds and the spectrum of the noise (physically
there). The other knows indicators of other machines (seen). Both answer with d', the distance of
healthy and faulty records in standard deviations.

OVERRIDES are those of gensig: fault=crack fault.crack_depth_mm=1 sensing=housing. The control is
plan.sham=true.

--sizes and --snrs ask which size is found at which noise: a table and a figure of size by
signal-to-noise ratio, at operating.speed_rpm and operating.torque_nm, in place of the maps."""
EXAMPLE = """\
examples:
  diagnose detectability fault=crack --plot crack.png --json crack.json
  diagnose detectability fault=pitting sensing=housing --speeds 600 1200 2400 --torques 10 40
  diagnose detectability fault=crack --sizes 0.5 1 2 3 --snrs 0 10 20 --plot sizes.png"""
FIGURE_TYPES = (".png", ".svg", ".pdf")
NOT_READ = {
    "out": "--json and --plot",
    "plan": "--n-units, --speeds, --torques",
    "executor": "--workers",
}
# Flags of the maps alone, and what to give in their place.
OF_MAPS = {
    "speeds": "give operating.speed_rpm=RPM",
    "torques": "give operating.torque_nm=NM",
    "fixed_noise": "leave it out",
}
RATIO = "sensing.snr_db"
READ_OF_PLAN = ("plan.n_gearboxes", "plan.sham", "plan.vary")


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_overrides(parser, "OVERRIDES")
    parser.add_argument(
        "--config-dir",
        metavar="DIR",
        help="folder with groups and options of your own (default: ./configs, if there)",
    )
    shares = "of the driving pinion (default: shares of the set-point,"
    parser.add_argument(
        "--speeds", nargs="+", metavar="RPM", help=f"{shares} a quarter to twice)"
    )
    parser.add_argument(
        "--torques", nargs="+", metavar="NM", help=f"{shares} a quarter to twice)"
    )
    parser.add_argument(
        "--sizes",
        nargs="+",
        metavar="SIZE",
        help="of the fault, in the unit of its first size: crack_depth_mm, pit_length_mm, "
        "wear_depth_um (default: with --snrs, a quarter to twice the configured one)",
    )
    parser.add_argument(
        "--snrs",
        nargs="+",
        metavar="DB",
        help="signal-to-noise ratios (default: with --sizes, 0 10 20 30)",
    )
    parser.add_argument(
        "--bandwidths",
        nargs="+",
        metavar="HZ",
        help="upper frequencies (default: 1000 to 20000)",
    )
    parser.add_argument(
        "--n-units",
        type=int,
        default=8,
        metavar="K",
        help="machines of the same build (default: 8)",
    )
    fixed = (
        "the noise of the set-point everywhere, as a sensor's own is "
        "(default: the same snr_db everywhere)"
    )
    parser.add_argument("--fixed-noise", action="store_true", help=fixed)
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: one a core)"
    )
    parser.add_argument("--json", metavar="FILE", help="write every number")
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )


def run(arguments: Namespace) -> int:
    """Make and write the maps; print the best test and the worst."""
    figure = _file("--plot", arguments.plot, FIGURE_TYPES)
    table = _file("--json", arguments.json, (".json",))
    if arguments.workers is not None and arguments.workers < 1:
        raise ConfigError(f"--workers {arguments.workers} must be at least 1")
    overrides = list(arguments.overrides)
    numbers = {
        name: _numbers(f"--{name}", getattr(arguments, name), overrides)
        for name in ("speeds", "torques", "bandwidths", "sizes", "snrs")
    }
    _say_unread(overrides)
    if numbers["sizes"] is not None or numbers["snrs"] is not None:
        _refuse_of_maps(arguments)
        return _sample(arguments, overrides, numbers, figure, table)
    return _map(arguments, overrides, numbers, figure, table)


def _map(
    arguments: Namespace,
    overrides: Sequence[str],
    numbers: Mapping[str, list[float] | None],
    figure: Path | None,
    table: Path | None,
) -> int:
    """Maps over speed, torque, channel and bandwidth."""
    import gensig
    from diagnose.detectability.maps import confirm_best, make_maps, read_bandwidths
    from diagnose.detectability.summary import content, summary
    from diagnose.progress import progress
    from gensig.execution.base import read_n_workers

    bandwidths = numbers["bandwidths"]
    make_pairs = partial(
        gensig.fault_pairs,
        *overrides,
        speeds_rpm=numbers["speeds"],
        torques_nm=numbers["torques"],
        n_units=arguments.n_units,
        fixed_noise=arguments.fixed_noise,
        config_dir=arguments.config_dir,
    )
    with one_line_warnings("diagnose"):
        pairs = make_pairs()
    edges = read_bandwidths(bandwidths, pairs)
    with progress(pairs.n_cells, "simulating") as on_done:
        n_workers = read_n_workers(arguments.workers)
        maps = make_maps(pairs, edges, n_workers=n_workers, on_done=on_done)
    confirmation = confirm_best(maps, make_pairs(epoch=1))
    show(*summary(maps, confirmation))
    if maps.n_failed:
        show(f"{maps.n_failed} pairs did not stay finite and are left out")
    if table is not None:
        _write_json(table, content(maps, confirmation))
    if figure is not None:
        from diagnose.detectability.figure import detectability_figure

        detectability_figure(figure, maps)
    return 0


def _sample(
    arguments: Namespace,
    overrides: Sequence[str],
    numbers: Mapping[str, list[float] | None],
    figure: Path | None,
    table: Path | None,
) -> int:
    """Tables over the size of the fault and the signal-to-noise ratio."""
    import gensig
    from diagnose.detectability.maps import read_bandwidths
    from diagnose.detectability.sampling import make_sampling, read_axes
    from diagnose.detectability.sampling_text import sampling_content, sampling_lines
    from diagnose.progress import progress
    from gensig.execution.base import read_n_workers
    from gensig.options.compose import override_keys

    make = partial(
        gensig.fault_pairs, n_units=arguments.n_units, config_dir=arguments.config_dir
    )
    with one_line_warnings("diagnose"):
        base = make(*overrides)
    size = f"fault.{base.size_key}"
    typed = override_keys(overrides)
    for key, flag in ((size, "--sizes"), (RATIO, "--snrs")):
        if key in typed and numbers[flag.removeprefix("--")] is not None:
            raise ConfigError(f"{key} is given twice; leave it out, or {flag}")
    operating = base.config["operating"]

    def pairs_of(value: float, ratio: float, epoch: int) -> gensig.FaultPairs:
        sampled = (f"{size}={value!r}", f"{RATIO}={ratio!r}")
        kept = [
            word for word in overrides if word.partition("=")[0] not in (size, RATIO)
        ]
        return make(
            *kept,
            *sampled,
            speeds_rpm=[operating["speed_rpm"]],
            torques_nm=[operating["torque_nm"]],
            epoch=epoch,
        )

    axes = read_axes(base, numbers["sizes"], numbers["snrs"])
    for value in axes.sizes:
        pairs_of(value, axes.snrs_db[0], 0)  # refused before the first line of progress
    edges = read_bandwidths(numbers["bandwidths"], base)
    n_samples = len(axes.sizes) * len(axes.snrs_db)
    with progress(n_samples, "simulating") as on_done:
        sampling = make_sampling(
            axes,
            pairs_of,
            edges,
            n_workers=read_n_workers(arguments.workers),
            on_done=on_done,
        )
    show(*sampling_lines(sampling))
    if n_failed := int(sampling.values("n_failed").sum()):
        show(f"{n_failed} pairs did not stay finite and are left out")
    if table is not None:
        _write_json(table, sampling_content(sampling))
    if figure is not None:
        from diagnose.detectability.sampling_figure import sampling_figure

        sampling_figure(figure, sampling)
    return 0


def _refuse_of_maps(arguments: Namespace) -> None:
    """Refuse flags of the maps beside --sizes or --snrs."""
    for name, instead in OF_MAPS.items():
        if getattr(arguments, name):
            flag = f"--{name.replace('_', '-')}"
            raise ConfigError(
                f"{flag} is of the maps, not of --sizes and --snrs; {instead}"
            )


def _write_json(path: Path, content: Mapping[str, Any]) -> None:
    text = json.dumps(content, indent=1, allow_nan=False)
    path.write_text(f"{text}\n", encoding="utf-8")


def _say_unread(overrides: Sequence[str]) -> None:
    """Print one line on stderr for every typed key that a map does not read."""
    from gensig.options.compose import override_keys

    for key in override_keys(overrides):
        flag = NOT_READ.get(key.partition(".")[0])
        if flag is not None and key not in READ_OF_PLAN:
            note = f"{key} is not read by detectability; use {flag}"
            remark("diagnose", f"note: {note}")


def _numbers(
    flag: str, given: Sequence[str] | None, overrides: list[str]
) -> list[float] | None:
    """The numbers of a flag; overrides that were typed behind them join the others."""
    if given is None:
        return None
    overrides += [word for word in given if "=" in word]
    numbers = [word for word in given if "=" not in word]
    try:
        return [float(word) for word in numbers]
    except ValueError:
        raise ConfigError(f"{flag} {' '.join(numbers)}: give numbers") from None


def _file(flag: str, name: str | None, types: tuple[str, ...]) -> Path | None:
    """Refuse a file that cannot be written before anything is simulated for it."""
    if name is None:
        return None
    path = Path(name)
    if path.suffix not in types:
        raise ConfigError(f"{flag} {name}: the name must end in {', '.join(types)}")
    if not path.parent.is_dir():
        raise ConfigError(
            f"{flag} {name}: there is no folder {path.parent}; make it first"
        )
    return path
