"""``gensig implant``: healthy recordings of a machine plus residuals of simulated faults."""

from __future__ import annotations

import time
from argparse import Namespace
from pathlib import Path

from gensig.commands.console import step
from gensig.commands.sets.running import run
from gensig.dataset.folder.beginning import refuse_used
from gensig.errors import ConfigError
from gensig.implants.blocks import Block
from gensig.implants.implant_folder import HERE, begin_implants
from gensig.implants.implant_sources import ImplantSources, open_implanter
from gensig.implants.implanting import Implanter
from gensig.implants.options import ImplantOptions
from gensig.terminal.printing import show

OUT_WORD = "out="
NEEDED = {"healthy": "--healthy", "teeth": "--teeth", "speed_rpm": "--speed-rpm"}
GAIN_DB = (-10.0, 10.0)


def implant(arguments: Namespace) -> int:
    """Make a data set of implants, and say which blocks were held out."""
    for name, flag in NEEDED.items():
        if not getattr(arguments, name):
            raise ConfigError(
                f"{flag} is needed; gensig implant --help shows an example"
            )
    out = _out(arguments)
    refuse_used(out)
    begin = time.monotonic()
    sources = _sources(arguments)
    n_records = sources.options.n_records
    implanter = open_implanter(sources)
    with implanter.pairs.data:
        if not arguments.quiet:
            step(_made_of(implanter))
        maker = begin_implants(out, implanter, sources)
        status = run(
            out, HERE, arguments, n_records=n_records, begin=begin, maker=maker
        )
    if not (arguments.quiet or status):
        for line in held_out_lines(implanter.cut.blocks):
            show(line)
    return status


def _sources(arguments: Namespace) -> ImplantSources:
    files = [word for word in arguments.healthy if not word.startswith(OUT_WORD)]
    low, high = arguments.gain_db or GAIN_DB
    options = ImplantOptions(
        gain_db=(low, high),
        path=arguments.path,
        residual=arguments.residual,
        n_records=arguments.records,
        duration=arguments.duration,
        held_out=arguments.held_out,
        plain_healthy=arguments.plain_healthy,
        seed=arguments.seed,
    )
    channels = arguments.channels
    return ImplantSources(
        data=Path(arguments.folder),
        healthy=files,
        teeth=tuple(arguments.teeth),
        speed_rpm=tuple(arguments.speed_rpm),
        options=options,
        sampling_rate=arguments.sampling_rate,
        channels=None if channels is None else tuple(channels),
        unit=arguments.unit,
        array=arguments.array,
        tacho=arguments.tacho,
        pulses_per_turn=arguments.pulses_per_turn,
    )


def held_out_lines(blocks: tuple[Block, ...]) -> list[str]:
    """A line for each recording with samples that are held out."""
    parts: dict[str, list[Block]] = {}
    for block in blocks:
        if not block.carries:
            parts.setdefault(block.file, []).append(block)
    return [
        f"held out, for scores: {file} samples {held[0].start} to {held[-1].stop}"
        for file, held in parts.items()
    ]


def _made_of(implanter: Implanter) -> str:
    carriers, cut = implanter.carriers, implanter.cut
    speeds = ", ".join(
        f"{carrier.speed_rpm(0, len(carrier.turned)):.5g}" for carrier in carriers
    )
    seconds = cut.n_samples / carriers[0].recording.sampling_rate
    return (
        f"{len(carriers)} healthy recording(s) at {speeds} r/min: {len(cut.carrying)} blocks "
        f"carry, {len(cut.blocks) - len(cut.carrying)} are held out; records of {seconds:.3g} s"
    )


def _out(arguments: Namespace) -> Path:
    """Folder of the data set, as a word or as a flag; also behind the files of --healthy."""
    words = [*arguments.words]
    words += [word for word in arguments.healthy if word.startswith(OUT_WORD)]
    for word in words:
        if not word.startswith(OUT_WORD):
            raise ConfigError(f"{word}: only out=DIR is taken besides DATA")
    folders = [word.removeprefix(OUT_WORD) for word in words]
    if arguments.out_flag is not None:
        folders.append(arguments.out_flag)
    if len(folders) != 1 or not folders[0]:
        raise ConfigError(
            "out is required, once: give out=DIR, a folder that does not exist or is empty"
        )
    return Path(folders[0]).expanduser()
