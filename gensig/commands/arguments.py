"""What can be typed behind each verb of ``gensig``. Imports nothing that is slow."""

from __future__ import annotations

import argparse

OVERRIDES = "OVERRIDES are group=option and key=value, as in Hydra: fault=crack operating.speed_rpm=1200 seed=3."


def overrides(parser: argparse.ArgumentParser) -> None:
    """Arguments of every verb that takes a configuration."""
    parser.add_argument("overrides", nargs="*", metavar="OVERRIDES", help=OVERRIDES)
    parser.add_argument(
        "--config-dir", metavar="DIR", help="folder with groups and options of your own"
    )


def options(parser: argparse.ArgumentParser) -> None:
    """Arguments of options."""
    parser.add_argument(
        "what",
        nargs="?",
        metavar="GROUP[=OPTION]",
        help="options of a group, or keys of an option",
    )
    parser.add_argument(
        "--config-dir", metavar="DIR", help="folder with groups and options of your own"
    )
    parser.add_argument("--json", action="store_true", help="print as JSON")


def completion(parser: argparse.ArgumentParser) -> None:
    """Arguments of completion."""
    parser.add_argument(
        "shell", choices=("bash", "zsh", "fish"), help="the shell that reads it"
    )


def generate(parser: argparse.ArgumentParser) -> None:
    """Arguments of generate."""
    overrides(parser)
    parser.add_argument(
        "-m",
        "--multirun",
        action="store_true",
        help="one data set for each combination of values a,b",
    )
    parser.add_argument(
        "--quiet", action="store_true", help="print nothing but mistakes"
    )


def stiffness(parser: argparse.ArgumentParser) -> None:
    """Arguments of stiffness."""
    overrides(parser)
    parser.add_argument("--json", metavar="FILE", help="write the curves")
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )


def root_stress(parser: argparse.ArgumentParser) -> None:
    """Arguments of root-stress."""
    stiffness(parser)
    parser.add_argument(
        "--stress",
        type=float,
        metavar="MPA",
        help="take the load that gives this root stress instead of the torque",
    )


def modes(parser: argparse.ArgumentParser) -> None:
    """Arguments of modes."""
    overrides(parser)
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write all modes: natural_frequencies_hz, damping_ratio, shapes (by degree of freedom, largest 1), "
        "kinetic_energy_share (by node), mesh_strain_energy_share",
    )
    parser.add_argument(
        "--plot",
        metavar="FILE",
        help="write a figure: Campbell diagram and shapes (PNG, SVG or PDF)",
    )


def forced_response(parser: argparse.ArgumentParser) -> None:
    """Arguments of forced-response."""
    overrides(parser)
    parser.add_argument(
        "--speed",
        type=float,
        metavar="RPM",
        help="of the crank (default: excitation.reference)",
    )
    parser.add_argument(
        "--torque",
        type=float,
        metavar="NM",
        help="brake torque (default: excitation.reference)",
    )
    parser.add_argument(
        "--nodes",
        type=int,
        nargs="+",
        metavar="N",
        help="to show (default: with toothed wheels)",
    )
    parser.add_argument(
        "--run",
        type=float,
        nargs=3,
        metavar=("LOW", "HIGH", "STEP"),
        help="waterfall of speeds, r/min",
    )
    parser.add_argument(
        "--run-torque",
        type=float,
        default=0.0,
        metavar="NM",
        help="brake torque of run and sweep (default: 0)",
    )
    parser.add_argument(
        "--time",
        type=float,
        metavar="S",
        help="also integrate so many seconds with teeth that part and rattle",
    )
    parser.add_argument(
        "--sweep",
        type=float,
        nargs=3,
        metavar=("LOW", "HIGH", "S"),
        help="also integrate a run-up and run-down, r/min and seconds each way, under the brake torque of the run",
    )
    mesh = "also the root stress of the mesh of two gears, in time with --time; with dampers before and after"
    parser.add_argument("--mesh", type=int, nargs=2, metavar="N", help=mesh)
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write speed_fluctuation_rpm, angle_deg by orders, tooth forces, root stress, the run, the sweep",
    )
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )


def tune_damper(parser: argparse.ArgumentParser) -> None:
    """Arguments of tune-damper."""
    overrides(parser)
    parser.add_argument(
        "--out",
        required=True,
        metavar="FILE",
        help="option to write: DIR/system/NAME.yaml",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the file of --out"
    )
    parser.add_argument(
        "--mesh",
        type=int,
        nargs=2,
        required=True,
        metavar="N",
        help="nodes of its two gears",
    )
    parser.add_argument(
        "--nodes",
        type=int,
        nargs="+",
        metavar="N",
        help="with a damper each (default: the gears)",
    )
    parser.add_argument(
        "--most-inertia",
        type=float,
        metavar="KG_M2",
        help="of a ring (default: that of its node)",
    )
    parser.add_argument(
        "--viscous",
        action="store_true",
        help="rings that only a fluid holds (default: a spring too)",
    )
    speeds = "speeds of the crank, r/min (default: those of system.campbell, 25)"
    parser.add_argument(
        "--run", type=float, nargs=3, metavar=("LOW", "HIGH", "STEP"), help=speeds
    )
    parser.add_argument(
        "--torque",
        type=float,
        metavar="NM",
        help="brake torque (default: excitation.reference)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the search (default: 0)"
    )
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write forces, root stress and safety before and after",
    )
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )


def modify_flank(parser: argparse.ArgumentParser) -> None:
    """Arguments of modify-flank."""
    overrides(parser)
    parser.add_argument(
        "--out",
        required=True,
        metavar="FILE",
        help="option to write: DIR/modification/NAME.yaml",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the file of --out"
    )
    parser.add_argument(
        "--torques",
        type=float,
        nargs="+",
        metavar="NM",
        help="of the pinion (default: the configured)",
    )
    parser.add_argument(
        "--misalignments",
        type=float,
        nargs="+",
        default=[0.0],
        metavar="UM",
        help="over the face (default: 0)",
    )
    parser.add_argument(
        "--points",
        type=int,
        default=7,
        metavar="N",
        help="of the front; 1: least ripple (default: 7)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the search (default: 0)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the front")
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )


def wear_life(parser: argparse.ArgumentParser) -> None:
    """Arguments of wear-life."""
    overrides(parser)
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write life, wear, sliding and pressure along the flank",
    )
    parser.add_argument(
        "--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)"
    )
    parser.add_argument(
        "--map",
        action="store_true",
        help="lives over torque and speed, and laws fitted to them",
    )
    parser.add_argument(
        "--torques",
        type=float,
        nargs="+",
        metavar="NM",
        help="of the map (default: 1/4 to 3/2)",
    )
    parser.add_argument(
        "--speeds",
        type=float,
        nargs="+",
        metavar="RPM",
        help="of the map (default: 1/4 to twice)",
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        help="write the worn flanks as an option: DIR/fault/NAME.yaml",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the file of --out"
    )


def simulate(parser: argparse.ArgumentParser) -> None:
    """Arguments of simulate."""
    overrides(parser)
    parser.add_argument(
        "--from",
        dest="folder",
        metavar="DIR",
        help="a record of this data set, made again",
    )
    parser.add_argument(
        "--record", metavar="I", help="with --from: number or id of the record"
    )
    parser.add_argument(
        "--twin",
        action="store_true",
        help="with --from: the same without its faults, noise included",
    )
    parser.add_argument(
        "--output",
        metavar="FILE",
        help="write the record: .h5 (a shard of one record) or .csv",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the file of --output"
    )
    parser.add_argument(
        "--plot",
        metavar="FILE",
        help="write a figure: signal, spectrum, envelope spectrum",
    )


def plan(parser: argparse.ArgumentParser) -> None:
    """Arguments of plan."""
    overrides(parser)
    parser.add_argument(
        "--freeze",
        action="store_true",
        help="make the folder out=DIR, ready for resume or array jobs",
    )


def folder(parser: argparse.ArgumentParser) -> None:
    """Arguments of a verb on a folder."""
    parser.add_argument("folder", metavar="DIR", help="folder of a data set")


def twin(parser: argparse.ArgumentParser) -> None:
    """Arguments of twin."""
    parser.add_argument(
        "recording",
        metavar="RECORDING",
        help="healthy recording: .csv (time_s and sensors), .npy, .npz, .wav, .h5, .mat",
    )
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="OVERRIDES",
        help="what you know of the gears: gear.pinion.face_width_mm=15",
    )
    two = ("DRIVING", "DRIVEN")
    parser.add_argument(
        "--teeth",
        type=int,
        nargs=2,
        required=True,
        metavar=two,
        help="teeth of both gears",
    )
    parser.add_argument(
        "--speed",
        type=float,
        required=True,
        metavar="RPM",
        help="of the driving gear, within 3 %%",
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder for the options; its name becomes theirs",
    )
    parser.add_argument(
        "--rate",
        type=float,
        metavar="HZ",
        help="samples a second, where the file does not tell",
    )
    parser.add_argument(
        "--unit",
        default="m/s2",
        help="m/s2 or g, where the column does not say (default: m/s2)",
    )
    parser.add_argument(
        "--channels", nargs="+", metavar="NAME", help="columns to use (default: all)"
    )
    parser.add_argument(
        "--array",
        metavar="NAME",
        help="array of a .npz, .h5 or .mat file (default: acceleration)",
    )
    parser.add_argument(
        "--module", type=float, metavar="MM", help="normal module (default: 2, assumed)"
    )
    parser.add_argument(
        "--torque",
        type=float,
        metavar="NM",
        help="of the driving gear (default: assumed by size)",
    )
    parser.add_argument(
        "--check",
        metavar="FILE",
        help="healthy recording held out (default: the second half)",
    )


def new(parser: argparse.ArgumentParser) -> None:
    """Arguments of new."""
    parser.add_argument("what", choices=("gearbox",), help="what to make")
    parser.add_argument("name", metavar="NAME", help="of the options that are written")
    two = ("PINION", "WHEEL")
    parser.add_argument(
        "--teeth", type=int, nargs=2, metavar=two, help="needed; teeth of both gears"
    )
    parser.add_argument(
        "--module", type=float, metavar="MM", help="needed; normal module"
    )
    parser.add_argument(
        "--speed", type=float, metavar="RPM", help="needed; rated speed of the pinion"
    )
    parser.add_argument(
        "--torque", type=float, metavar="NM", help="needed; rated torque of the pinion"
    )
    parser.add_argument(
        "--widths",
        type=float,
        nargs="+",
        metavar="MM",
        help="face width of both or each (default: 10 modules)",
    )
    parser.add_argument(
        "--bores",
        type=float,
        nargs="+",
        metavar="MM",
        help="bore diameters (default: by the torque)",
    )
    parser.add_argument(
        "--helix",
        type=float,
        metavar="DEG",
        help="helix angle of the pinion (default: 0, spur)",
    )
    parser.add_argument(
        "--pressure-angle",
        type=float,
        metavar="DEG",
        help="of the basic rack (default: 20)",
    )
    parser.add_argument(
        "--profile-shifts",
        type=float,
        nargs="+",
        metavar="X",
        help="profile shifts (default: 0)",
    )
    parser.add_argument(
        "--addendum",
        type=float,
        metavar="X",
        help="of the teeth, over the module (default: 1)",
    )
    stiffness = "radial stiffness of what holds each gear (default: of ball bearings and shafts)"
    parser.add_argument(
        "--supports", type=float, nargs="+", metavar="N_PER_M", help=stiffness
    )
    parser.add_argument(
        "--experiment",
        choices=("plain", "realistic"),
        default="plain",
        help="what the plan is made on: clean signals at the bearings, or as measured (default: plain)",
    )
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="samples a second (default: 51200)"
    )
    parser.add_argument(
        "--duration",
        type=float,
        metavar="S",
        help="of a record (default: at least 10 turns)",
    )
    parser.add_argument(
        "--grade",
        type=int,
        metavar="N",
        help="of ISO 1328 (default: that of the experiment)",
    )
    parser.add_argument(
        "--classes",
        nargs="+",
        metavar="FAULT",
        help="healthy and faults (default: five)",
    )
    parser.add_argument(
        "--sensors",
        nargs="+",
        metavar="NAME",
        help="on the housing, with --experiment realistic",
    )
    ends = ("LOW", "HIGH")
    parser.add_argument(
        "--speed-range",
        type=float,
        nargs=2,
        metavar=ends,
        help="shares of the rated speed (default: 0.5 1.2)",
    )
    parser.add_argument(
        "--torque-range",
        type=float,
        nargs=2,
        metavar=ends,
        help="shares of the rated torque (default: 0.3 1.2)",
    )
    parser.add_argument(
        "--dir", default="configs", help="folder of your options (default: configs)"
    )
    parser.add_argument(
        "--json", action="store_true", help="print what was derived as JSON"
    )


def resume(parser: argparse.ArgumentParser) -> None:
    """Arguments of resume."""
    folder(parser)
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="OVERRIDES",
        help="executor=... and executor.key=...; other keys must agree",
    )
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="worker processes (default: one a core)",
    )
    parser.add_argument(
        "--quiet", action="store_true", help="print nothing but mistakes"
    )


def reproduce(parser: argparse.ArgumentParser) -> None:
    """Arguments of reproduce."""
    folder(parser)
    parser.add_argument(
        "--records",
        type=int,
        default=10,
        metavar="N",
        help="records, spread evenly (default: 10)",
    )


def inspect(parser: argparse.ArgumentParser) -> None:
    """Arguments of inspect."""
    parser.add_argument(
        "path", metavar="PATH", help="folder of a data set, or an HDF5 file"
    )


def verify(parser: argparse.ArgumentParser) -> None:
    """Arguments of verify."""
    parser.add_argument("folder", metavar="DIR", help="folder of a data set")
    parser.add_argument("--quick", action="store_true", help="sizes and manifest only")


def validate(parser: argparse.ArgumentParser) -> None:
    """Arguments of validate."""
    parser.add_argument(
        "--markdown",
        metavar="FILE",
        help="write the whole comparison as a Markdown page",
    )


def export(parser: argparse.ArgumentParser) -> None:
    """Arguments of export."""
    parser.add_argument(
        "folder", metavar="DIR", help="folder of a complete data set; it is left alone"
    )
    parser.add_argument(
        "--to", required=True, metavar="FORMAT", help="hdf5, parquet, npz or wav"
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="PATH",
        help="file (wav: folder) that does not exist yet",
    )
    parser.add_argument(
        "--samples",
        action="store_true",
        help="parquet: time signals too, not only the labels",
    )
    parser.add_argument(
        "--one-channel",
        action="store_true",
        help="wav: one file a channel, not one a record",
    )


def report(parser: argparse.ArgumentParser) -> None:
    """Arguments of report."""
    parser.add_argument("folder", metavar="DIR", help="folder of a complete data set")
    parser.add_argument(
        "--out",
        metavar="FILE",
        help="page to write, a new file (default: DIR/report.html)",
    )
    parser.add_argument(
        "--records",
        type=int,
        metavar="N",
        help="records shown of each class (default: up to 3)",
    )
