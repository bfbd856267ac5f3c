"""What ``gensig`` can do.

Every verb, its arguments and an example. Imports nothing that is slow.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from gensig.commands import arguments


@dataclass(frozen=True)
class Verb:
    """One verb: what it does, an example, its own arguments, and ``module:function`` that runs it.

    ``one`` is the meaning of exit status 1, where the verb has it. Verbs that look at one machine
    have ``instead``: keys that they do not read, each with the flag that does its work or an
    empty text. ``reads`` are the sections of the configuration that such a verb reads, by the
    kind of machine (the empty kind stands for all others). None reads all of them. A typed key
    outside is named on stderr.
    """

    summary: str
    example: str
    runs: str
    arguments: Callable[[argparse.ArgumentParser], None]
    one: str | None = None
    instead: Mapping[str, str] | None = None
    reads: Mapping[str, tuple[str, ...]] | None = None


# Sections of the configuration that make a machine: at rest, with its flanks in slices, and
# running.
GEARS = (
    "system",
    "gear",
    "material",
    "modification",
    "heat",
    "mesh",
    "operating",
    "fault",
)
RUNNING = (*GEARS, "sensing", "quality", "solver", "excitation")
TABLES = ("system", "material")
SPUR, HELICAL, OTHERS = "spur_pair", "helical_pair", ""
LINE_RUNNING = tuple(section for section in RUNNING if section != "gear")

VERBS: dict[str, Verb] = {
    "options": Verb(
        "groups, their options, and the keys of an option, a line each",
        "gensig options\n  gensig options fault\n  gensig options fault=crack --json",
        "gensig.commands.options:list_options",
        arguments.options,
    ),
    "generate": Verb(
        "make a labelled data set",
        "gensig generate experiment=quickstart out=runs/quickstart\n"
        "  gensig generate -m fault=healthy,crack plan.n_records=20 out=runs/two",
        "gensig.commands.sets.datasets:generate",
        arguments.generate,
        one="records failed and are marked so, or the set is incomplete: gensig resume DIR goes on",
    ),
    "plan": Verb(
        "dry run: records, bytes, predicted time",
        "gensig plan experiment=quickstart plan.n_records=2000\n"
        "  gensig plan experiment=quickstart out=runs/large --freeze",
        "gensig.commands.sets.datasets:plan",
        arguments.plan,
    ),
    "new": Verb(
        "options of a gearbox of your own, from its data sheet",
        "gensig new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60",
        "gensig.commands.new.gearbox:new",
        arguments.new,
    ),
    "resume": Verb(
        "finish an interrupted data set",
        "gensig resume runs/quickstart\n  gensig resume runs/quickstart executor=dask executor.n_workers=4",
        "gensig.commands.sets.datasets:resume",
        arguments.resume,
        one="records failed and are marked so, or the set is incomplete: gensig resume DIR goes on",
    ),
    "finalize": Verb(
        "close a data set made by array jobs, or accept an edited card",
        "gensig finalize runs/large",
        "gensig.commands.sets.datasets:finalize",
        arguments.folder,
        one="records failed and are marked so in the closed set",
    ),
    "verify": Verb(
        "is a data set whole and unaltered?",
        "gensig verify runs/quickstart",
        "gensig.commands.sets.datasets:verify",
        arguments.verify,
        one="damaged, altered or incomplete; every problem is printed",
    ),
    "reproduce": Verb(
        "simulate records of a data set again and compare",
        "gensig reproduce runs/quickstart --records 20",
        "gensig.commands.sets.datasets:reproduce",
        arguments.reproduce,
        one="records came out otherwise than recorded",
    ),
    "inspect": Verb(
        "what is in a data set or file",
        "gensig inspect runs/quickstart/shards/shard-00000.h5",
        "gensig.commands.sets.datasets:inspect",
        arguments.inspect,
    ),
    "report": Verb(
        "a data set as one HTML page: signals, spectra, parameters, indicators, splits",
        "gensig report runs/quickstart\n  gensig report runs/quickstart --out quickstart.html --records 5",
        "gensig.commands.sets.report:report",
        arguments.report,
    ),
    "export": Verb(
        "a data set as one HDF5 file, Parquet, npz or wav",
        "gensig export runs/quickstart --to parquet --out quickstart.parquet",
        "gensig.commands.sets.export:export",
        arguments.export,
    ),
    "transmission-error": Verb(
        "loaded flanks slice by slice: transmission error, line load, pressure",
        "gensig transmission-error system=helical_pair modification=beihang_both --plot te.png\n"
        "  gensig transmission-error gear=xiamen_23_84 operating.torque_nm=20 --json te.json",
        "gensig.commands.gears.flanks:transmission_error",
        arguments.stiffness,
        instead={"out": "--json or --plot"},
        reads={OTHERS: GEARS},
    ),
    "modify-flank": Verb(
        "reliefs and crowning that are best for your torques and misalignments",
        "gensig modify-flank system=helical_pair --out mine/modification/best.yaml\n"
        "  gensig modify-flank system=helical_pair --torques 100 178 --misalignments -5 0 5 --points 5 "
        "--out mine/modification/robust.yaml --plot front.png",
        "gensig.commands.gears.modify:modify_flank",
        arguments.modify_flank,
        instead={"out": "--out, --json or --plot"},
        reads={OTHERS: (*GEARS, "seed")},
    ),
    "root-stress": Verb(
        "bending stress at the tooth's root over the mesh, and safety factors",
        "gensig root-stress gear=engine_pump_drive --stress 349.39 --json root.json --plot root.png\n"
        "  gensig root-stress system=helical_pair strength.mean_stress_factor=0.7",
        "gensig.commands.gears.strength:root_stress",
        arguments.root_stress,
        instead={"out": "--json or --plot"},
        reads={SPUR: (*RUNNING, "strength"), OTHERS: (*GEARS, "quality", "strength")},
    ),
    "wear-life": Verb(
        "how long flanks last until they are worn, and what their wear looks like",
        "gensig wear-life gear=harbin_38_55 wear.threshold_um=50 --json life.json --plot life.png\n"
        "  gensig wear-life operating.torque_nm=40 --map --out mine/fault/worn.yaml",
        "gensig.commands.gears.wear:wear_life_verb",
        arguments.wear_life,
        instead={"out": "--out, --json or --plot"},
        reads={OTHERS: (*RUNNING, "wear", "plan", "dataset", "seed")},
    ),
    "simulate": Verb(
        "one record: signal, spectrum, figure",
        "gensig simulate fault=missing_tooth operating.speed_rpm=1500 --plot missing.png --output missing.csv\n"
        "  gensig simulate --from runs/quickstart --record 7 --twin --output twin.h5",
        "gensig.commands.gears.physics:simulate",
        arguments.simulate,
        one="the record did not stay finite, or its solver gave up; nothing is written",
        instead={"plan": "", "executor": "", "out": "--output"},
    ),
    "stiffness": Verb(
        "mesh stiffness of sound and faulty teeth",
        "gensig stiffness fault=crack fault.crack_depth_mm=1.5 --json crack.json --plot crack.png\n"
        "  gensig stiffness system=helical_pair gear=chongqing_40_162 heat=chongqing_rated --plot hot.png",
        "gensig.commands.gears.physics:stiffness",
        arguments.stiffness,
        instead={"out": "--json or --plot"},
        reads={SPUR: RUNNING, HELICAL: GEARS, OTHERS: LINE_RUNNING},
    ),
    "modes": Verb(
        "natural frequencies, damping, shapes of a pair or of a drive line from tables",
        "gensig modes system=engine_gear_train --json modes.json --plot modes.png\n"
        "  gensig modes system=shaft_line system.shafting_csv=mine.csv system.gears_csv=my_gears.csv",
        "gensig.commands.lines.modes:modes",
        arguments.modes,
        instead={"out": "--json or --plot"},
        reads={SPUR: RUNNING, HELICAL: RUNNING, OTHERS: (*TABLES, "fault")},
    ),
    "forced-response": Verb(
        "steady vibration of a drive line under its engine: speed fluctuation, spectra, waterfalls, tooth forces",
        "gensig forced-response system=engine_gear_train excitation=engine_v20 --run 650 1750 10 --plot response.png",
        "gensig.commands.lines.forced_response:forced_response",
        arguments.forced_response,
        instead={
            "operating.speed_rpm": "--speed",
            "operating.torque_nm": "--torque",
            "out": "--json or --plot",
        },
        reads={
            OTHERS: (
                *TABLES,
                "excitation",
                "seed",
                "mesh",
                "strength",
                "quality",
                "modification",
            )
        },
    ),
    "tune-damper": Verb(
        "torsional dampers that make the worst tooth force of an engine's mesh least; root stress before and after",
        "gensig tune-damper system=engine_gear_train excitation=engine_v20 --mesh 21 45 "
        "--out mine/system/damped.yaml --plot dampers.png",
        "gensig.commands.lines.tune_damper:tune_damper",
        arguments.tune_damper,
        instead={"operating.speed_rpm": "--run", "operating.torque_nm": "--torque"},
        reads={
            OTHERS: (
                *TABLES,
                "excitation",
                "seed",
                "mesh",
                "strength",
                "quality",
                "modification",
            )
        },
    ),
    "twin": Verb(
        "a configuration like a measured healthy machine",
        "gensig twin healthy.csv --teeth 23 46 --speed 2000 --module 2 --torque 20 --out my_machine\n"
        "  gensig generate --config-dir my_machine experiment=my_machine out=runs/my_machine",
        "gensig.commands.sets.twin:twin",
        arguments.twin,
    ),
    "completion": Verb(
        "what to source so that the tab key completes both commands",
        'gensig completion bash\n  eval "$(gensig completion zsh)"\n  gensig completion fish',
        "gensig.terminal.completion:completion",
        arguments.completion,
    ),
    "validate": Verb(
        "every printed figure of the source papers against ours",
        "gensig validate --markdown docs/validation.md",
        "gensig.commands.validate:validate",
        arguments.validate,
        one="rows have another verdict than they declare",
    ),
}
