"""Verbs on one machine, with their arguments, examples and the sections that they read."""

from __future__ import annotations

from gensig.commands.flags import (
    CONFIGURATION,
    PLOT,
    REPLACE_OUT,
    SEARCH_SEED,
    Verb,
    count,
    counts,
    json_file,
    number,
    numbers,
    required_out,
    switch,
    text,
)

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
ENGINE = (
    *TABLES,
    "excitation",
    "seed",
    "mesh",
    "strength",
    "quality",
    "modification",
)
SPUR, HELICAL, OTHERS = "spur_pair", "helical_pair", ""
LINE_RUNNING = tuple(section for section in RUNNING if section != "gear")

CURVES = (*CONFIGURATION, json_file("write the curves"), PLOT)
SPEED_STEPS = ("LOW", "HIGH", "STEP")
FILES_INSTEAD = {"out": "--json or --plot"}
OPTION_INSTEAD = {"out": "--out, --json or --plot"}

MACHINE_VERBS = {
    "transmission-error": Verb(
        summary="loaded flanks slice by slice: transmission error, line load, pressure",
        examples=(
            "gensig transmission-error system=helical_pair modification=beihang_both --plot te.png",
            "gensig transmission-error gear=xiamen_23_84 operating.torque_nm=20 --json te.json",
        ),
        runs="gensig.commands.gears.flanks:transmission_error",
        arguments=CURVES,
        instead=FILES_INSTEAD,
        reads={OTHERS: GEARS},
    ),
    "modify-flank": Verb(
        summary="reliefs and crowning that are best for your torques and misalignments",
        examples=(
            "gensig modify-flank system=helical_pair --out mine/modification/best.yaml",
            "gensig modify-flank system=helical_pair --torques 100 178 --misalignments -5 0 5"
            " --points 5 --out mine/modification/robust.yaml --plot front.png",
        ),
        runs="gensig.commands.gears.modify:modify_flank",
        arguments=(
            *CONFIGURATION,
            required_out("FILE", "option to write: DIR/modification/NAME.yaml"),
            REPLACE_OUT,
            numbers("--torques", "NM", "of the pinion (default: the configured)"),
            numbers(
                "--misalignments", "UM", "over the face (default: 0)", default=[0.0]
            ),
            count(
                "--points",
                "N",
                "of the front; 1: least ripple (default: 7)",
                default=7,
            ),
            SEARCH_SEED,
            json_file("write the front"),
            PLOT,
        ),
        instead=OPTION_INSTEAD,
        reads={OTHERS: (*GEARS, "seed")},
    ),
    "root-stress": Verb(
        summary="bending stress at the tooth's root over the mesh, and safety factors",
        examples=(
            "gensig root-stress gear=engine_pump_drive --stress 349.39"
            " --json root.json --plot root.png",
            "gensig root-stress system=helical_pair strength.mean_stress_factor=0.7",
        ),
        runs="gensig.commands.gears.strength:root_stress",
        arguments=(
            *CURVES,
            number(
                "--stress",
                "MPA",
                "take the load that gives this root stress instead of the torque",
            ),
        ),
        instead=FILES_INSTEAD,
        reads={SPUR: (*RUNNING, "strength"), OTHERS: (*GEARS, "quality", "strength")},
    ),
    "figures": Verb(
        summary="figures of the papers, ours beside the printed numbers, as PNG and CSV",
        examples=(
            "gensig figures helical_heat --dir runs/figures",
            "gensig figures spur 8 14 --dir runs/figures",
        ),
        runs="gensig.commands.paper_figures:figures",
        arguments=(
            text("paper", "PAPER", "spur, helical_heat, helical_error, engine or wear"),
            text(
                "numbers",
                "FIGURE",
                "numbers of its figures (default: all that simulation can draw)",
                nargs="*",
            ),
            text("--dir", "DIR", "folder for the files", required=True),
        ),
    ),
    "wear-life": Verb(
        summary="how long flanks last until they are worn, and what their wear looks like",
        examples=(
            "gensig wear-life gear=harbin_38_55 wear.threshold_um=50"
            " --json life.json --plot life.png",
            "gensig wear-life operating.torque_nm=40 --map --out mine/fault/worn.yaml",
        ),
        runs="gensig.commands.gears.wear:wear_life_verb",
        arguments=(
            *CONFIGURATION,
            json_file("write life, wear, sliding and pressure along the flank"),
            PLOT,
            switch(
                "--map",
                help="lives over torque and speed, and laws fitted to them",
            ),
            numbers("--torques", "NM", "of the map (default: 1/4 to 3/2)"),
            numbers("--speeds", "RPM", "of the map (default: 1/4 to twice)"),
            text(
                "--out",
                "FILE",
                "write the worn flanks as an option: DIR/fault/NAME.yaml",
            ),
            REPLACE_OUT,
        ),
        instead=OPTION_INSTEAD,
        reads={OTHERS: (*RUNNING, "wear", "plan", "dataset", "seed")},
    ),
    "simulate": Verb(
        summary="one record: signal, spectrum, figure",
        examples=(
            "gensig simulate fault=missing_tooth operating.speed_rpm=1500"
            " --plot missing.png --output missing.csv",
            "gensig simulate operating=ramp --plot run_up.png --orders run_up.csv",
            "gensig simulate --from runs/quickstart --record 7 --twin --output twin.h5",
        ),
        runs="gensig.commands.gears.simulate:simulate",
        arguments=(
            *CONFIGURATION,
            text(
                "--from", "DIR", "a record of this data set, made again", dest="folder"
            ),
            text("--record", "I", "with --from: number or id of the record"),
            switch(
                "--twin",
                help="with --from: the same without its faults, noise included",
            ),
            text(
                "--output",
                "FILE",
                "write the record: .h5 (a shard of one record) or .csv",
            ),
            switch("--force", help="replace the file of --output"),
            text(
                "--plot",
                "FILE",
                "write a figure: signal, spectrum, envelope spectrum; of a run-up: order map, "
                "waterfall with natural frequencies, order cuts",
            ),
            text(
                "--orders",
                "FILE",
                "of a run-up: write the RMS of every order over the speed (.csv)",
            ),
        ),
        status_1="the record did not stay finite, or its solver gave up; nothing is written",
        instead={"plan": "", "executor": "", "life": "", "out": "--output"},
    ),
    "run-up": Verb(
        summary="vibration over the speed of a run-up, of variants of a machine side by side",
        examples=(
            "gensig run-up system=helical_pair operating=ramp operating.speed_rpm=5000"
            " --against modification=beihang_least_ripple modification=beihang_even_load"
            " modification=beihang_both --plot modified.png",
        ),
        runs="gensig.commands.gears.run_up_variants:run_up",
        arguments=(
            *CONFIGURATION,
            text(
                "--against",
                "OVERRIDE",
                "of one more variant each, added to the others",
                nargs="+",
                default=[],
            ),
            json_file(
                "write speeds_rpm, and by variant rms_m_per_s2, level_db, change_db: total_ of "
                "all orders, mesh_ of the mesh and its harmonics"
            ),
            PLOT,
        ),
        status_1="a record did not stay finite, or its solver gave up; nothing is written",
        instead={"plan": "", "executor": "", "life": "", **FILES_INSTEAD},
    ),
    "stiffness": Verb(
        summary="mesh stiffness of healthy and faulty teeth",
        examples=(
            "gensig stiffness fault=crack fault.crack_depth_mm=1.5"
            " --json crack.json --plot crack.png",
            "gensig stiffness system=helical_pair gear=chongqing_40_162 heat=chongqing_rated"
            " --plot hot.png",
        ),
        runs="gensig.commands.gears.physics:stiffness",
        arguments=CURVES,
        instead=FILES_INSTEAD,
        reads={SPUR: RUNNING, HELICAL: GEARS, OTHERS: LINE_RUNNING},
    ),
    "modes": Verb(
        summary="natural frequencies, damping, shapes of a pair or of a drive line from tables",
        examples=(
            "gensig modes system=engine_gear_train --json modes.json --plot modes.png",
            "gensig modes system=shaft_line system.shafting_csv=mine.csv"
            " system.gears_csv=my_gears.csv",
        ),
        runs="gensig.commands.lines.modes:modes",
        arguments=(
            *CONFIGURATION,
            json_file(
                "write all modes: natural_frequencies_hz, damping_ratio, shapes (by degree "
                "of freedom, largest 1), kinetic_energy_share (by node), "
                "mesh_strain_energy_share"
            ),
            text(
                "--plot",
                "FILE",
                "write a figure: Campbell diagram and shapes (PNG, SVG or PDF)",
            ),
        ),
        instead=FILES_INSTEAD,
        reads={SPUR: RUNNING, HELICAL: RUNNING, OTHERS: (*TABLES, "fault")},
    ),
    "forced-response": Verb(
        summary="steady vibration of a drive line under its engine: "
        "speed fluctuation, spectra, waterfalls, tooth forces",
        examples=(
            "gensig forced-response system=engine_gear_train excitation=engine_v20"
            " --run 650 1750 10 --plot response.png",
        ),
        runs="gensig.commands.lines.forced_response:forced_response",
        arguments=(
            *CONFIGURATION,
            number("--speed", "RPM", "of the crank (default: excitation.reference)"),
            number("--torque", "NM", "brake torque (default: excitation.reference)"),
            counts("--nodes", "N", "to show (default: with toothed wheels)"),
            numbers("--run", SPEED_STEPS, "waterfall of speeds, r/min"),
            number(
                "--run-torque",
                "NM",
                "brake torque of run and sweep (default: 0)",
                default=0.0,
            ),
            number(
                "--time",
                "S",
                "also integrate so many seconds with teeth that part and rattle",
            ),
            numbers(
                "--sweep",
                ("LOW", "HIGH", "S"),
                "also integrate a run-up and run-down, r/min and seconds each way, "
                "under the brake torque of the run",
            ),
            count(
                "--mesh",
                "N",
                "also the root stress of the mesh of two gears, in time with --time; "
                "with dampers before and after",
                nargs=2,
            ),
            json_file(
                "write speed_fluctuation_rpm, angle_deg by orders, tooth forces, "
                "root stress, the run, the sweep"
            ),
            PLOT,
        ),
        instead={
            "operating.speed_rpm": "--speed",
            "operating.torque_nm": "--torque",
            **FILES_INSTEAD,
        },
        reads={OTHERS: ENGINE},
    ),
    "tune-damper": Verb(
        summary="torsional dampers that make the worst tooth force of an engine's mesh least; "
        "root stress before and after",
        examples=(
            "gensig tune-damper system=engine_gear_train excitation=engine_v20 --mesh 21 45"
            " --out mine/system/damped.yaml --plot dampers.png",
        ),
        runs="gensig.commands.lines.tune_damper:tune_damper",
        arguments=(
            *CONFIGURATION,
            required_out("FILE", "option to write: DIR/system/NAME.yaml"),
            REPLACE_OUT,
            count(
                "--mesh",
                "N",
                "nodes of its two gears",
                nargs=2,
                required=True,
            ),
            counts("--nodes", "N", "with a damper each (default: the gears)"),
            number("--most-inertia", "KG_M2", "of a ring (default: that of its node)"),
            switch(
                "--viscous",
                help="rings that only a fluid holds (default: a spring too)",
            ),
            numbers(
                "--run",
                SPEED_STEPS,
                "speeds of the crank, r/min (default: those of system.campbell, 25)",
            ),
            number("--torque", "NM", "brake torque (default: excitation.reference)"),
            SEARCH_SEED,
            json_file("write forces, root stress and safety before and after"),
            PLOT,
        ),
        instead={"operating.speed_rpm": "--run", "operating.torque_nm": "--torque"},
        reads={OTHERS: ENGINE},
    ),
}
