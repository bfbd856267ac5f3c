"""``gensig implant``: healthy recordings of a machine plus residuals of simulated faults."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from gensig.commands.console import step
from gensig.dataset.folder.beginning import refuse_used
from gensig.dataset.reader import open_dataset
from gensig.errors import ConfigError
from gensig.implants.blocks import Block
from gensig.implants.gearing import Gearing
from gensig.implants.implant_folder import write_implants
from gensig.implants.implanting import Implanter, taken_recordings
from gensig.implants.options import ImplantOptions
from gensig.terminal.run_progress import Progress, RunProgress

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
    gearing = Gearing(teeth=tuple(arguments.teeth))
    files = [word for word in arguments.healthy if not word.startswith(OUT_WORD)]
    with open_dataset(Path(arguments.folder).expanduser()) as data:
        recordings = taken_recordings(
            files,
            sampling_rate=arguments.sampling_rate,
            channels=arguments.channels,
            unit=arguments.unit,
            array=arguments.array,
            tacho=arguments.tacho,
        )
        implanter = Implanter(
            data,
            recordings,
            gearing,
            arguments.speed_rpm,
            options,
            pulses_per_turn=arguments.pulses_per_turn,
        )
        if not arguments.quiet:
            step(_made_of(implanter))
        with RunProgress(
            quiet=arguments.quiet, n_records=options.n_records
        ) as progress:
            write_implants(
                out, implanter, typed=_typed(arguments), tell=_shown(progress)
            )
    if not arguments.quiet:
        print(
            f"{out}: {options.n_records} records; gensig inspect {out} describes them"
        )
        for line in held_out_lines(implanter.cut.blocks):
            print(line)
    return 0


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


def _shown(progress: RunProgress) -> Callable[[int, int], None]:
    def show(n_done: int, n_records: int) -> None:
        state = Progress(
            n_done=n_done,
            n_records=n_records,
            n_failed=0,
            n_made=n_done,
            n_bytes=0,
            reason="",
        )
        progress(state)

    return show


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


def _typed(arguments: Namespace) -> list[str]:
    """Words of the command that decide the set, without folders."""
    taken = vars(arguments)
    names = ("teeth", "speed_rpm", "gain_db", "path", "residual", "records", "seed")
    return [f"{name}={taken[name]}" for name in names if taken[name] is not None]
