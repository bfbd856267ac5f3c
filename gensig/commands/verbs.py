"""What ``gensig`` can do: every verb, its arguments and an example. Imports nothing that is slow."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass

OVERRIDES = "OVERRIDES are group=option and key=value, as in Hydra: fault=crack operating.speed_rpm=1200 seed=3."


@dataclass(frozen=True)
class Verb:
    """One verb: what it does, an example, its own arguments, and ``module:function`` that runs it.

    ``one`` says what exit status 1 means, where the verb has it. ``instead`` maps keys that it does not read to the
    flag that does their work, or to nothing; it stands where the verb looks at one machine, and what else was typed
    and not read is named as well.
    """

    summary: str
    example: str
    runs: str
    arguments: Callable[[argparse.ArgumentParser], None]
    one: str | None = None
    instead: Mapping[str, str] | None = None


def _overrides(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("overrides", nargs="*", metavar="OVERRIDES", help=OVERRIDES)
    parser.add_argument("--config-dir", metavar="DIR", help="folder with groups and options of your own")


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", nargs="?", metavar="GROUP[=OPTION]", help="options of a group, or keys of an option")
    parser.add_argument("--config-dir", metavar="DIR", help="folder with groups and options of your own")
    parser.add_argument("--json", action="store_true", help="print as JSON")


def _completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell that reads it")


def _generate(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("-m", "--multirun", action="store_true", help="one data set for each combination of values a,b")
    parser.add_argument("--quiet", action="store_true", help="print nothing but mistakes")


def _stiffness(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--json", metavar="FILE", help="write the curves")
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)")


def _root_stress(parser: argparse.ArgumentParser) -> None:
    _stiffness(parser)
    parser.add_argument(
        "--stress", type=float, metavar="MPA", help="take the load that gives this root stress instead of the torque"
    )


def _modes(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write all modes: natural_frequencies_hz, damping_ratio, shapes (by degree of freedom, largest 1), "
        "kinetic_energy_share (by node), mesh_strain_energy_share",
    )
    parser.add_argument("--plot", metavar="FILE", help="write a figure: Campbell diagram and shapes (PNG, SVG or PDF)")


def _forced_response(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--speed", type=float, metavar="RPM", help="of the crank (default: excitation.reference)")
    parser.add_argument("--torque", type=float, metavar="NM", help="brake torque (default: excitation.reference)")
    parser.add_argument("--nodes", type=int, nargs="+", metavar="N", help="to show (default: with toothed wheels)")
    parser.add_argument(
        "--run", type=float, nargs=3, metavar=("LOW", "HIGH", "STEP"), help="waterfall of speeds, r/min"
    )
    parser.add_argument(
        "--run-torque", type=float, default=0.0, metavar="NM", help="brake torque of run and sweep (default: 0)"
    )
    parser.add_argument(
        "--time", type=float, metavar="S", help="also integrate so many seconds with teeth that part and rattle"
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
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)")


def _tune_damper(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help="option to write: DIR/system/NAME.yaml")
    parser.add_argument("--mesh", type=int, nargs=2, required=True, metavar="N", help="nodes of its two gears")
    parser.add_argument("--nodes", type=int, nargs="+", metavar="N", help="with a damper each (default: the gears)")
    parser.add_argument("--most-inertia", type=float, metavar="KG_M2", help="of a ring (default: that of its node)")
    parser.add_argument("--viscous", action="store_true", help="rings that only a fluid holds (default: a spring too)")
    speeds = "speeds of the crank, r/min (default: those of system.campbell, 25)"
    parser.add_argument("--run", type=float, nargs=3, metavar=("LOW", "HIGH", "STEP"), help=speeds)
    parser.add_argument("--torque", type=float, metavar="NM", help="brake torque (default: excitation.reference)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the search (default: 0)")
    parser.add_argument("--json", metavar="FILE", help="write forces, root stress and safety before and after")
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)")


def _modify_flank(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help="option to write: DIR/modification/NAME.yaml")
    parser.add_argument(
        "--torques", type=float, nargs="+", metavar="NM", help="of the pinion (default: the configured)"
    )
    parser.add_argument(
        "--misalignments", type=float, nargs="+", default=[0.0], metavar="UM", help="over the face (default: 0)"
    )
    parser.add_argument("--points", type=int, default=7, metavar="N", help="of the front; 1: least ripple (default: 7)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the search (default: 0)")
    parser.add_argument("--json", metavar="FILE", help="write the front")
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)")


def _wear_life(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--json", metavar="FILE", help="write life, wear, sliding and pressure along the flank")
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG or PDF)")
    parser.add_argument("--map", action="store_true", help="lives over torque and speed, and laws fitted to them")
    parser.add_argument("--torques", type=float, nargs="+", metavar="NM", help="of the map (default: 1/4 to 3/2)")
    parser.add_argument("--speeds", type=float, nargs="+", metavar="RPM", help="of the map (default: 1/4 to twice)")
    parser.add_argument("--out", metavar="FILE", help="write the worn flanks as an option: DIR/fault/NAME.yaml")


def _simulate(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--from", dest="folder", metavar="DIR", help="a record of this data set, made again")
    parser.add_argument("--record", metavar="I", help="with --from: number or id of the record")
    parser.add_argument("--twin", action="store_true", help="with --from: the same without its faults, noise included")
    parser.add_argument("--output", metavar="FILE", help="write the record: .h5 (a shard of one record) or .csv")
    parser.add_argument("--plot", metavar="FILE", help="write a figure: signal, spectrum, envelope spectrum")


def _plan(parser: argparse.ArgumentParser) -> None:
    _overrides(parser)
    parser.add_argument("--freeze", action="store_true", help="make the folder out=DIR, ready for resume or array jobs")


def _folder(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="folder of a data set")


def _twin(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording",
        metavar="RECORDING",
        help="healthy recording: .csv (time_s and sensors), .npy, .npz, .wav, .h5, .mat",
    )
    parser.add_argument(
        "overrides", nargs="*", metavar="OVERRIDES", help="what you know of the gears: gear.pinion.face_width_mm=15"
    )
    two = ("DRIVING", "DRIVEN")
    parser.add_argument("--teeth", type=int, nargs=2, required=True, metavar=two, help="teeth of both gears")
    parser.add_argument("--speed", type=float, required=True, metavar="RPM", help="of the driving gear, within 3 %%")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the options; its name becomes theirs")
    parser.add_argument("--rate", type=float, metavar="HZ", help="samples a second, where the file does not tell")
    parser.add_argument("--unit", default="m/s2", help="m/s2 or g, where the column does not say (default: m/s2)")
    parser.add_argument("--channels", nargs="+", metavar="NAME", help="columns to use (default: all)")
    parser.add_argument("--array", metavar="NAME", help="array of a .npz, .h5 or .mat file (default: acceleration)")
    parser.add_argument("--module", type=float, metavar="MM", help="normal module (default: 2, assumed)")
    parser.add_argument("--torque", type=float, metavar="NM", help="of the driving gear (default: assumed by size)")
    parser.add_argument("--check", metavar="FILE", help="healthy recording held out (default: the second half)")


def _new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=("gearbox",), help="what to make")
    parser.add_argument("name", metavar="NAME", help="of the options that are written")
    two = ("PINION", "WHEEL")
    parser.add_argument("--teeth", type=int, nargs=2, metavar=two, help="needed; teeth of both gears")
    parser.add_argument("--module", type=float, metavar="MM", help="needed; normal module")
    parser.add_argument("--speed", type=float, metavar="RPM", help="needed; rated speed of the pinion")
    parser.add_argument("--torque", type=float, metavar="NM", help="needed; rated torque of the pinion")
    parser.add_argument(
        "--widths", type=float, nargs="+", metavar="MM", help="face width of both or each (default: 10 modules)"
    )
    parser.add_argument("--bores", type=float, nargs="+", metavar="MM", help="bore diameters (default: by the torque)")
    parser.add_argument("--helix", type=float, metavar="DEG", help="helix angle of the pinion (default: 0, spur)")
    parser.add_argument("--pressure-angle", type=float, metavar="DEG", help="of the basic rack (default: 20)")
    parser.add_argument("--profile-shifts", type=float, nargs="+", metavar="X", help="profile shifts (default: 0)")
    stiffness = "radial stiffness of what holds each gear (default: of ball bearings and shafts)"
    parser.add_argument("--supports", type=float, nargs="+", metavar="N_PER_M", help=stiffness)
    parser.add_argument("--dir", default="configs", help="folder of your options (default: configs)")
    parser.add_argument("--json", action="store_true", help="print what was derived as JSON")


def _resume(parser: argparse.ArgumentParser) -> None:
    _folder(parser)
    parser.add_argument(
        "overrides", nargs="*", metavar="OVERRIDES", help="executor=... and executor.key=...; other keys must agree"
    )
    parser.add_argument("--workers", type=int, metavar="N", help="worker processes (default: one a core)")
    parser.add_argument("--quiet", action="store_true", help="print nothing but mistakes")


def _reproduce(parser: argparse.ArgumentParser) -> None:
    _folder(parser)
    parser.add_argument("--records", type=int, default=10, metavar="N", help="records, spread evenly (default: 10)")


def _inspect(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="folder of a data set, or an HDF5 file")


def _verify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="folder of a data set")
    parser.add_argument("--quick", action="store_true", help="sizes and manifest only")


def _validate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--markdown", metavar="FILE", help="write the whole comparison as a Markdown page")


def _export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="folder of a complete data set; it is left alone")
    parser.add_argument("--to", required=True, metavar="FORMAT", help="hdf5, parquet, npz or wav")
    parser.add_argument("--out", required=True, metavar="PATH", help="file (wav: folder) that does not exist yet")
    parser.add_argument("--samples", action="store_true", help="parquet: time signals too, not only the labels")
    parser.add_argument("--one-channel", action="store_true", help="wav: one file a channel, not one a record")


def _report(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="folder of a complete data set")
    parser.add_argument("--out", metavar="FILE", help="page to write, a new file (default: DIR/report.html)")
    parser.add_argument("--records", type=int, metavar="N", help="records shown of each class (default: up to 3)")


VERBS: dict[str, Verb] = {
    "options": Verb(
        "groups, their options, and the keys of an option, a line each",
        "gensig options\n  gensig options fault\n  gensig options fault=crack --json",
        "gensig.commands.options:list_options",
        _options,
    ),
    "generate": Verb(
        "make a labelled data set",
        "gensig generate experiment=quickstart out=runs/quickstart\n"
        "  gensig generate -m fault=healthy,crack plan.n_records=20 out=runs/two",
        "gensig.commands.datasets:generate",
        _generate,
        one="records failed and are marked so, or the set is incomplete: gensig resume DIR goes on",
    ),
    "plan": Verb(
        "dry run: records, bytes, predicted time",
        "gensig plan experiment=quickstart plan.n_records=2000\n"
        "  gensig plan experiment=quickstart out=runs/large --freeze",
        "gensig.commands.datasets:plan",
        _plan,
    ),
    "new": Verb(
        "options of a gearbox of your own, from its data sheet",
        "gensig new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60",
        "gensig.commands.new:new",
        _new,
    ),
    "resume": Verb(
        "finish an interrupted data set",
        "gensig resume runs/quickstart\n  gensig resume runs/quickstart executor=dask executor.n_workers=4",
        "gensig.commands.datasets:resume",
        _resume,
        one="records failed and are marked so, or the set is incomplete: gensig resume DIR goes on",
    ),
    "finalize": Verb(
        "close a data set made by array jobs, or accept an edited card",
        "gensig finalize runs/large",
        "gensig.commands.datasets:finalize",
        _folder,
        one="records failed and are marked so in the closed set",
    ),
    "verify": Verb(
        "is a data set whole and unaltered?",
        "gensig verify runs/quickstart",
        "gensig.commands.datasets:verify",
        _verify,
        one="damaged, altered or incomplete; every problem is printed",
    ),
    "reproduce": Verb(
        "simulate records of a data set again and compare",
        "gensig reproduce runs/quickstart --records 20",
        "gensig.commands.datasets:reproduce",
        _reproduce,
        one="records came out otherwise than recorded",
    ),
    "inspect": Verb(
        "what is in a data set or file",
        "gensig inspect runs/quickstart/shards/shard-00000.h5",
        "gensig.commands.datasets:inspect",
        _inspect,
    ),
    "report": Verb(
        "a data set as one HTML page: signals, spectra, parameters, indicators, splits",
        "gensig report runs/quickstart\n  gensig report runs/quickstart --out quickstart.html --records 5",
        "gensig.commands.dataset_report:report",
        _report,
    ),
    "export": Verb(
        "a data set as one HDF5 file, Parquet, npz or wav",
        "gensig export runs/quickstart --to parquet --out quickstart.parquet",
        "gensig.commands.export:export",
        _export,
    ),
    "transmission-error": Verb(
        "loaded flanks slice by slice: transmission error, line load, pressure",
        "gensig transmission-error system=helical_pair modification=beihang_both --plot te.png\n"
        "  gensig transmission-error gear=xiamen_23_84 operating.torque_nm=20 --json te.json",
        "gensig.commands.flanks:transmission_error",
        _stiffness,
        instead={"out": "--json or --plot"},
    ),
    "modify-flank": Verb(
        "reliefs and crowning that are best for your torques and misalignments",
        "gensig modify-flank system=helical_pair --out mine/modification/best.yaml\n"
        "  gensig modify-flank system=helical_pair --torques 100 178 --misalignments -5 0 5 --points 5 "
        "--out mine/modification/robust.yaml --plot front.png",
        "gensig.commands.modify:modify_flank",
        _modify_flank,
        instead={"out": "--out, --json or --plot"},
    ),
    "root-stress": Verb(
        "bending stress at the tooth's root over the mesh, and safety factors",
        "gensig root-stress gear=engine_pump_drive --stress 349.39 --json root.json --plot root.png\n"
        "  gensig root-stress system=helical_pair strength.mean_stress_factor=0.7",
        "gensig.commands.strength:root_stress",
        _root_stress,
        instead={"out": "--json or --plot"},
    ),
    "wear-life": Verb(
        "how long flanks last until they are worn, and what their wear looks like",
        "gensig wear-life gear=harbin_38_55 wear.threshold_um=50 --json life.json --plot life.png\n"
        "  gensig wear-life operating.torque_nm=40 --map --out mine/fault/worn.yaml",
        "gensig.commands.wear:wear_life_verb",
        _wear_life,
        instead={"out": "--out, --json or --plot"},
    ),
    "simulate": Verb(
        "one record: signal, spectrum, figure",
        "gensig simulate fault=missing_tooth operating.speed_rpm=1500 --plot missing.png --output missing.csv\n"
        "  gensig simulate --from runs/quickstart --record 7 --twin --output twin.h5",
        "gensig.commands.physics:simulate",
        _simulate,
        one="the record did not stay finite, or its solver gave up; nothing is written",
        instead={"plan": "", "executor": "", "out": "--output"},
    ),
    "stiffness": Verb(
        "mesh stiffness of sound and faulty teeth",
        "gensig stiffness fault=crack fault.crack_depth_mm=1.5 --json crack.json --plot crack.png\n"
        "  gensig stiffness system=helical_pair gear=chongqing_40_162 heat=chongqing_rated --plot hot.png",
        "gensig.commands.physics:stiffness",
        _stiffness,
        instead={"out": "--json or --plot"},
    ),
    "modes": Verb(
        "natural frequencies, damping, shapes of a pair or of a drive line from tables",
        "gensig modes system=engine_gear_train --json modes.json --plot modes.png\n"
        "  gensig modes system=shaft_line system.shafting_csv=mine.csv system.gears_csv=my_gears.csv",
        "gensig.commands.modes:modes",
        _modes,
        instead={"out": "--json or --plot"},
    ),
    "forced-response": Verb(
        "steady vibration of a drive line under its engine: speed fluctuation, spectra, waterfalls, tooth forces",
        "gensig forced-response system=engine_gear_train excitation=engine_v20 --run 650 1750 10 --plot response.png",
        "gensig.commands.forced_response:forced_response",
        _forced_response,
        instead={"operating.speed_rpm": "--speed", "operating.torque_nm": "--torque", "out": "--json or --plot"},
    ),
    "tune-damper": Verb(
        "torsional dampers that make the worst tooth force of an engine's mesh least; root stress before and after",
        "gensig tune-damper system=engine_gear_train excitation=engine_v20 --mesh 21 45 "
        "--out mine/system/damped.yaml --plot dampers.png",
        "gensig.commands.tune_damper:tune_damper",
        _tune_damper,
        instead={"operating.speed_rpm": "--run", "operating.torque_nm": "--torque"},
    ),
    "twin": Verb(
        "a configuration like a measured healthy machine",
        "gensig twin healthy.csv --teeth 23 46 --speed 2000 --module 2 --torque 20 --out my_machine\n"
        "  gensig generate --config-dir my_machine experiment=my_machine out=runs/my_machine",
        "gensig.commands.twin:twin",
        _twin,
    ),
    "completion": Verb(
        "what to source so that the tab key completes both commands",
        'gensig completion bash\n  eval "$(gensig completion zsh)"\n  gensig completion fish',
        "gensig.completion:completion",
        _completion,
    ),
    "validate": Verb(
        "every printed figure of the source papers against ours",
        "gensig validate --markdown docs/validation.md",
        "gensig.commands.validate:validate",
        _validate,
        one="rows have another verdict than they declare",
    ),
}
