"""Verbs on data sets and on options, with their arguments and examples."""

from __future__ import annotations

from gensig.commands.flags import (
    ARRAY,
    CHANNELS,
    CONFIG_DIR,
    CONFIGURATION,
    FOLDER,
    MULTIRUN,
    OUT,
    QUIET,
    STORED,
    UNIT,
    WORKERS,
    Argument,
    Verb,
    choice,
    count,
    counts,
    number,
    numbers,
    overrides,
    required_out,
    switch,
    text,
)

INCOMPLETE = (
    "records failed and are marked so, or the set is incomplete: "
    "gensig resume DIR goes on"
)
ENDS = ("LOW", "HIGH")

NEW_GEARBOX = (
    choice("what", ("gearbox",), "what to make"),
    text("name", "NAME", "of the options that are written"),
    counts(
        "--teeth",
        "N",
        "needed; teeth of pinion and wheel, of each stage in turn: two, four or six",
    ),
    numbers("--module", "MM", "needed; normal module, one or one a stage"),
    number("--speed", "RPM", "needed; rated speed of the pinion, of the first stage"),
    number("--torque", "NM", "needed; rated torque of the same"),
    numbers(
        "--widths",
        "MM",
        "face width of both or each, of several stages one a stage (default: 10 modules)",
    ),
    numbers("--bores", "MM", "bore diameters (default: by the torque)"),
    number("--helix", "DEG", "helix angle of the pinion (default: 0, spur)"),
    number("--pressure-angle", "DEG", "of the basic rack (default: 20)"),
    numbers("--profile-shifts", "X", "profile shifts (default: 0)"),
    number("--addendum", "X", "of the teeth, over the module (default: 1)"),
    numbers(
        "--supports",
        "N_PER_M",
        "radial stiffness of what holds each gear (default: of ball bearings and shafts)",
    ),
    choice(
        "--experiment",
        ("plain", "realistic"),
        "what the plan is made on: clean signals at the bearings, "
        "or as measured (default: plain)",
        default="plain",
    ),
    number("--rate", "HZ", "samples a second (default: 51200)"),
    number("--duration", "S", "of a record (default: at least 10 turns)"),
    count("--grade", "N", "of ISO 1328 (default: that of the experiment)"),
    text("--classes", "FAULT", "healthy and faults (default: five)", nargs="+"),
    text("--sensors", "NAME", "on the housing, with --experiment realistic", nargs="+"),
    numbers("--speed-range", ENDS, "shares of the rated speed (default: 0.5 1.2)"),
    numbers("--torque-range", ENDS, "shares of the rated torque (default: 0.3 1.2)"),
    Argument(
        ("--dir",),
        {
            "default": "configs",
            "help": "folder of your options (default: configs)",
        },
    ),
    switch(
        "--no-level",
        help="do not simulate healthy machines to tell how loud they are",
    ),
    switch("--json", help="print what was derived as JSON"),
)

TWIN = (
    text(
        "recording",
        "RECORDING",
        "healthy recording: .csv (time_s and sensors), .npy, .npz, .wav, .h5, .mat",
    ),
    overrides("what you know of the gears: gear.pinion.face_width_mm=15"),
    counts(
        "--teeth",
        ("DRIVING", "DRIVEN"),
        "teeth of both gears",
        required=True,
    ),
    number("--speed", "RPM", "of the driving gear, within 3 %%", required=True),
    required_out("DIR", "folder for the options; its name becomes theirs"),
    number("--rate", "HZ", "samples a second, where the file does not tell"),
    UNIT,
    CHANNELS,
    ARRAY,
    number("--module", "MM", "normal module (default: 2, assumed)"),
    number("--torque", "NM", "of the driving gear (default: assumed by size)"),
    text("--check", "FILE", "healthy recording held out (default: the second half)"),
)

IMPLANT = (
    text("folder", "DATA", "simulated data set without noise, with healthy twins"),
    text("words", "out=DIR", "folder that does not exist or is empty", nargs="*"),
    OUT,
    text(
        "--healthy",
        "FILE",
        "needed; healthy recordings: .csv, .npy, .npz, .wav, .h5, .mat",
        nargs="+",
    ),
    counts("--teeth", "Z", "needed; driving and driven gear, of each stage in turn"),
    numbers(
        "--speed-rpm",
        "RPM",
        "needed; of the driving shaft, within 3 %%; one, or one a recording",
    ),
    number("--sampling-rate", "HZ", "of the files, where they do not tell"),
    CHANNELS,
    UNIT,
    ARRAY,
    text(
        "--tacho",
        "NAME",
        "channel with the pulses of the driving shaft (default: mesh)",
    ),
    count("--pulses-per-turn", "N", "of it (default: 1)", default=1),
    numbers(
        "--gain-db",
        ("LOW", "HIGH"),
        "level of a residual over its carrier, uniform (default: -10 10)",
    ),
    choice(
        "--path",
        ("twin", "none"),
        "response from the simulated sensor: fitted as by gensig twin, or left out "
        "(default: twin)",
        default="twin",
    ),
    choice(
        "--residual",
        ("physics", "noise_bursts", "shuffled_phases", "none"),
        "what is implanted: physics, or a control (default: physics)",
        default="physics",
    ),
    count("--records", "N", "of the set (default: 600)", default=600),
    number("--duration", "S", "of a record (default: by the length of the recordings)"),
    number(
        "--held-out",
        "SHARE",
        "of the blocks of each recording, its last ones, that carry nothing (default: 0.25)",
        default=0.25,
    ),
    number(
        "--plain-healthy",
        "SHARE",
        "of the healthy records that carry nothing (default: 0.5)",
        default=0.5,
    ),
    count("--seed", "N", "of what is drawn (default: 0)", default=0),
    QUIET,
)

SET_VERBS = {
    "options": Verb(
        summary="groups, their options, and the keys of an option, a line each",
        examples=(
            "gensig options",
            "gensig options fault",
            "gensig options fault=crack --json",
        ),
        runs="gensig.commands.options:list_options",
        arguments=(
            text(
                "what",
                "GROUP[=OPTION]",
                "options of a group, or keys of an option",
                nargs="?",
            ),
            CONFIG_DIR,
            switch("--json", help="print as JSON"),
        ),
    ),
    "generate": Verb(
        summary="make a labelled data set",
        examples=(
            "gensig generate experiment=quickstart out=runs/quickstart",
            "gensig generate -m fault=healthy,crack plan.n_records=20 out=runs/two",
            "gensig generate --config runs/quickstart/config.yaml seed=2 out=runs/other",
        ),
        runs="gensig.commands.sets.datasets:generate",
        arguments=(
            *CONFIGURATION,
            STORED,
            MULTIRUN,
            OUT,
            WORKERS,
            QUIET,
        ),
        status_1=INCOMPLETE,
    ),
    "plan": Verb(
        summary="dry run: records, bytes, predicted time",
        examples=(
            "gensig plan experiment=quickstart plan.n_records=2000",
            "gensig plan experiment=quickstart out=runs/large --freeze",
            "gensig plan experiment=quickstart fault=crack --show-config",
        ),
        runs="gensig.commands.sets.datasets:plan",
        arguments=(
            *CONFIGURATION,
            STORED,
            MULTIRUN,
            OUT,
            WORKERS,
            switch(
                "--freeze",
                help="make the folder out=DIR, ready for resume or array jobs",
            ),
            switch(
                "--show-config",
                help="print the configuration as YAML, and nothing else",
            ),
            choice("--cfg", ("job",), "as --show-config"),
        ),
    ),
    "new": Verb(
        summary="options of a gearbox of your own, from its data sheet",
        examples=(
            "gensig new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60",
            "gensig new gearbox mine --teeth 29 100 36 90 --module 1.5 2"
            " --speed 1500 --torque 10",
        ),
        runs="gensig.commands.new.gearbox:new",
        arguments=NEW_GEARBOX,
    ),
    "resume": Verb(
        summary="finish an interrupted data set, or make again what one has lost",
        examples=(
            "gensig resume runs/quickstart",
            "gensig resume runs/quickstart executor=dask executor.n_workers=4",
        ),
        runs="gensig.commands.sets.datasets:resume",
        arguments=(
            FOLDER,
            overrides("executor=... and executor.key=...; other keys must agree"),
            WORKERS,
            QUIET,
        ),
        status_1=INCOMPLETE,
    ),
    "finalize": Verb(
        summary="close a data set made by array jobs, or accept an edited card",
        examples=("gensig finalize runs/large",),
        runs="gensig.commands.sets.datasets:finalize",
        arguments=(FOLDER,),
        status_1="records failed and are marked so in the closed set",
    ),
    "verify": Verb(
        summary="is a data set whole and unaltered?",
        examples=("gensig verify runs/quickstart",),
        runs="gensig.commands.sets.checks:verify",
        arguments=(FOLDER, switch("--quick", help="sizes and manifest only")),
        status_1="damaged, altered or incomplete; every problem is printed",
    ),
    "reproduce": Verb(
        summary="simulate records of a data set again and compare",
        examples=(
            "gensig reproduce runs/quickstart --records 20",
            "gensig reproduce runs/quickstart --records r000016,r000020",
        ),
        runs="gensig.commands.sets.checks:reproduce",
        arguments=(
            FOLDER,
            text(
                "--records",
                "N|ID,ID",
                "a number of records, spread evenly, or the ids of some (default: 10)",
                default="10",
            ),
        ),
        status_1="records came out otherwise than recorded",
    ),
    "inspect": Verb(
        summary="what is in a data set or file",
        examples=(
            "gensig inspect runs/quickstart/shards/shard-00000.h5",
            "gensig inspect missing.csv",
        ),
        runs="gensig.commands.sets.checks:inspect",
        arguments=(text("path", "PATH", "folder of a data set, HDF5 file or CSV"),),
    ),
    "report": Verb(
        summary="a data set as one HTML page: signals, spectra, parameters, indicators, splits",
        examples=(
            "gensig report runs/quickstart",
            "gensig report runs/quickstart --out quickstart.html --records 5",
        ),
        runs="gensig.commands.sets.export:report",
        arguments=(
            text("folder", "DIR", "folder of a complete data set"),
            text(
                "--out",
                "FILE",
                "page to write; replaces an earlier one (default: DIR/report.html)",
            ),
            count(
                "--records",
                "N",
                "records shown of each class (default: up to 3)",
            ),
        ),
    ),
    "export": Verb(
        summary="a data set as one HDF5 file, Parquet, npz, wav or for Hugging Face, with splits",
        examples=(
            "gensig export runs/quickstart --to parquet --out quickstart.parquet",
            "gensig export runs/quickstart --to hf --protocol new_machine --out quickstart_hf",
        ),
        runs="gensig.commands.sets.export:export",
        arguments=(
            text("folder", "DIR", "folder of a complete data set; it is left alone"),
            text("--to", "FORMAT", "hdf5, parquet, npz, wav or hf", required=True),
            required_out("PATH", "file (wav, hf: folder) that does not exist yet"),
            text(
                "--protocol",
                "NAME",
                "split to export, may be repeated; 'all': every one that keeps machines apart "
                "(default: all, hf: new_machine, in a crossed set by_unit); "
                "random_window_leaky only by its name",
                action="append",
            ),
            switch("--samples", help="parquet: time signals too, not only the labels"),
            switch("--one-channel", help="wav: one file a channel, not one a record"),
        ),
    ),
}

OTHER_VERBS = {
    "measured": Verb(
        summary="what a folder of measured recordings holds: classes, sets of gears, hashes, gaps",
        examples=(
            "gensig measured",
            "gensig measured mcc5_thu downloads/mcc5_thu",
            "gensig measured rig/measured.yaml --hashes",
        ),
        runs="gensig.commands.sets.measured:measured",
        arguments=(
            text(
                "words",
                "SET DIR",
                "a known set and its folder, or a YAML; nothing lists the sets",
                nargs="*",
            ),
            switch("--hashes", help="print the sha256 of each file in full"),
            switch("--json", help="print as JSON"),
        ),
    ),
    "twin": Verb(
        summary="a configuration like a measured healthy machine",
        examples=(
            "gensig twin healthy.csv --teeth 23 46 --speed 2000 --module 2 --torque 20"
            " --out my_machine",
            "gensig generate --config-dir my_machine experiment=my_machine out=runs/my_machine",
        ),
        runs="gensig.commands.sets.twin:twin",
        arguments=TWIN,
    ),
    "implant": Verb(
        summary="a labelled data set: your healthy recordings plus residuals of simulated faults",
        examples=(
            "gensig generate experiment=quickstart sensing.snr_db=null plan.n_reference=0"
            " dataset.store_healthy_twin=true"
            " plan.classes=[healthy,missing_tooth,distributed_pitting] out=runs/faults",
            "gensig implant runs/faults out=runs/mine --teeth 29 95 36 90 --speed-rpm 1480"
            " --healthy monday.csv tuesday.csv",
            "diagnose train data=runs/mine out=runs/mine_report model=cnn",
        ),
        runs="gensig.commands.sets.implant:implant",
        arguments=IMPLANT,
    ),
    "completion": Verb(
        summary="tab completion of both commands in bash, zsh or fish",
        examples=(
            "gensig completion bash",
            'eval "$(gensig completion zsh)"',
            "gensig completion fish",
        ),
        runs="gensig.terminal.completion:completion",
        arguments=(
            choice("shell", ("bash", "zsh", "fish"), "the shell that reads it"),
        ),
    ),
    "validate": Verb(
        summary="every printed figure of the source papers against ours",
        examples=("gensig validate --markdown docs/validation.md",),
        runs="gensig.commands.validate:validate",
        arguments=(
            text(
                "--markdown",
                "FILE",
                "write the whole comparison as a Markdown page",
            ),
        ),
        status_1="rows have another verdict than they declare",
    ),
}
