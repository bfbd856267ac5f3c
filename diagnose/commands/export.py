"""``diagnose export``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from diagnose.commands.parser import add_model, note_unsigned
from gensig.errors import ConfigError, DatasetError
from gensig.terminal.printing import show

HELP = """\
Write a trained network for other programs, and check the file against torch.

The file takes windows (window, channel, sample) in m/s2 as float32 and gives log-probabilities
(window, class); it takes off mean and RMS of the windows itself. Names of classes and channels,
rate, window and temperature are in its metadata. The file of a model of remaining life also takes
the values that the model must know (window, column), and gives hours."""
EXAMPLE = """\
example:
  diagnose export --to onnx --model runs/cnn/models/new_machine-seed0 --out gearbox.onnx"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    parser.add_argument(
        "--to",
        required=True,
        choices=["onnx"],
        help="format; needs the packages of the extra onnx",
    )
    add_model(parser)
    parser.add_argument(
        "--out",
        required=True,
        metavar="FILE",
        help="file to write, .onnx; must not exist",
    )


def run(arguments: Namespace) -> int:
    """Write the file, check it, and print how well it agrees with torch."""
    out = Path(arguments.out)
    if out.suffix != ".onnx":
        raise ConfigError(f"--out {out}: the name must end in .onnx")
    if out.exists() or out.is_symlink():
        raise DatasetError(f"--out {out} exists; choose another or remove it")
    if not out.parent.is_dir():
        raise DatasetError(f"--out {out}: there is no folder {out.parent}")
    from diagnose.recordings.onnx_export import export_onnx, need_packages
    from diagnose.recordings.registry import open_network

    need_packages()
    network = open_network(arguments.model)
    note_unsigned(arguments.model, network.description)
    agreement = export_onnx(network, out)
    size = out.stat().st_size / 1e3
    show(f"{out}: {size:.0f} kB, {agreement} on windows of many levels")
    return 0
