"""``python -m benchmarks.bridge``: are faults told on machines of other worlds, and by what?

By networks that compare with two healthy recordings of the machine: trained in one simulated
world as it is, without the ringing of the housing, on a randomised set, and with its re-draws. All
units of a world are judged, since none takes part. Beside them a network on windows without
healthy recordings, and one trained in the other world with labels. Then the negative control:
recordings of two states that differ in the mounting, read from the folder ``$GENSIG_MEASURED``
where it is set.

``--classes`` makes the worlds with other faults, ``--model`` judges further stored networks there.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import gensig
from benchmarks import _bridge_control as control
from benchmarks import _bridge_healthy as healthy
from benchmarks import _bridge_worlds as worlds
from benchmarks._measure import machine, print_machine
from benchmarks._realism_recording import VARIABLE
from diagnose.cli import main as diagnose_main
from gensig.errors import ConfigError, GensigError

TRAINING = (
    "model=cnn",
    "baselines=false",
    "shuffle_control=false",
)
SEEDS = (0, 1, 2)
# Networks that compare with all sound records of a machine: the set that each is trained on, the
# protocol that holds machines back, and further words of diagnose train.
COMPARED = (
    "model=tooth",
    "reference=none",
    "model.reference=every_condition",
    "baselines=false",
    "shuffle_control=false",
    "metadata_probe=false",
    "oracle=false",
)
ALONE, NEW = "by_unit", "new_machine"
QUIET = ("model.whitened=machine",)
REDRAWN = (*QUIET, "model.redraws=8")
REDRAWN_LESS = (*QUIET, "model.redraws=4")
# name of a set, as of its folder -> overrides
SETS = {
    "source": worlds.SOURCE,
    "bridge": worlds.BRIDGE,
    "separate": worlds.SEPARATE,
    "separate_machines": worlds.SEPARATE_MACHINES,
}
PLAIN = "no healthy"  # on windows, with the words of TRAINING alone
WITH_HEALTHY = {
    "two healthy": ("source", ALONE, ()),
    "without ringing": ("source", ALONE, QUIET),
    "without ringing, re-drawn": ("source", ALONE, REDRAWN),
    "randomised": ("bridge", NEW, QUIET),
    "randomised, re-drawn": ("bridge", NEW, REDRAWN),
    "many machines, re-drawn": ("separate", NEW, REDRAWN_LESS),
    "many hard machines, re-drawn": ("separate_machines", NEW, REDRAWN_LESS),
}
NETWORKS = (*WITH_HEALTHY, PLAIN)
TOLD = (
    "cpu_model",
    "python",
    "numpy",
    "gensig",
    "created",
)  # of the machine, in the file


def main(arguments: Sequence[str] | None = None) -> int:
    """Make what is not there yet, judge, print, and write the figures.

    0 when it was made, whatever it says.
    """
    options = _parser().parse_args(arguments)
    named, begun = machine(), time.perf_counter()
    print_machine(named)
    place = nullcontext(options.data) if options.data else tempfile.TemporaryDirectory()
    try:
        with place as folder, _one_thread():
            result = _judged(Path(folder), options)
    except (GensigError, OSError) as error:
        print(f"benchmarks.bridge: {error}", file=sys.stderr)
        return 1
    print(f"\n{time.perf_counter() - begun:.0f} s")
    if options.json:
        told = {key: named[key] for key in TOLD}
        text = json.dumps({"machine": told, "seeds": SEEDS, **result}, indent=1)
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


def _judged(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """All parts of the benchmark; with other classes those of the worlds alone."""
    classes = options.classes.split(",") if options.classes else []
    chosen = options.networks or NETWORKS
    networks = networks_with_healthy(folder, classes, chosen, options.model)
    result = {"with_healthy": judge_worlds(folder, classes, networks)}
    if not classes and not options.model and not options.networks:
        result["control"] = judge_control(folder)
    return result


def networks_with_healthy(
    folder: Path,
    classes: Sequence[str],
    chosen: Sequence[str],
    further: Sequence[str] = (),
) -> dict[str, healthy.Judge]:
    """Networks that compare with healthy records, and one without, by name.

    Parameters
    ----------
    folder : of data sets and models
    classes : of all sets, in place of theirs
    chosen : names of `NETWORKS`
    further : networks to judge beside those, each as ``NAME=MODEL=DATA``
    """
    mark = _mark(classes)
    result: dict[str, healthy.Judge] = {}
    for name in chosen:
        set_name, protocol, own = WITH_HEALTHY.get(name, ("source", ALONE, ()))
        target, words = folder / f"{_file_name(name)}{mark}", (*COMPARED, *own)
        if name == PLAIN:
            words = ()
        data = folder / f"{set_name}{mark}"
        opened = worlds.open_world(data, SETS[set_name], classes)
        models = trained(target, data, *words, protocol=protocol)
        result[name] = healthy.judge_of(models, opened)
    for text in further:
        name, model, place = text.split("=", 2)
        result[name] = healthy.judge_of([Path(model)], gensig.open_dataset(place))
    return result


def judge_worlds(
    folder: Path, classes: Sequence[str], networks: Mapping[str, healthy.Judge]
) -> dict[str, Any]:
    """Scores of networks in each world, and in the three of one that was trained there.

    Parameters
    ----------
    folder : of data sets and models
    classes : of all sets, in place of theirs
    networks : by name
    """
    mark = _mark(classes)
    beside = {} if classes else worlds.BESIDE
    result: dict[str, Any] = {}
    for world_name, words in {**worlds.WORLDS, **beside}.items():
        target = f"{_file_name(world_name)}{mark}"
        world = worlds.open_world(folder / target, words, classes)
        print(f"\n{world_name}: all units")
        result[world_name] = rows = {}
        for name, judge in networks.items():
            answers = judge.answers(world)
            for shifted in (False,) if name == PLAIN else (False, True):
                row = healthy.scores_of(answers, world.class_names, shifted=shifted)
                key = f"{name}, threshold" if shifted else name
                rows[key] = row
                recall = " ".join(f"{each:.2f}" for each in row["recall"].values())
                print(f"  {key:<40}{_said(row)}  recall {recall}", flush=True)
        if PLAIN in networks and world_name in worlds.WORLDS:
            there = folder / f"healthy_{target}"
            trained(there, world.folder, *COMPARED, *QUIET)
            rows["trained there"] = own = _own_score(there)
            print(f"  {'trained there':<40}{_said(own)} on its own test units")
    return result


def _mark(classes: Sequence[str]) -> str:
    """End of the names of all folders of these classes."""
    return "".join(f"_{name}" for name in classes)


def _file_name(name: str) -> str:
    return name.replace(",", "").replace(" ", "_")


def judge_control(folder: Path) -> dict[str, Any]:
    """Rows of the negative control for each set trained on.

    None where the recordings are not there.
    """
    file = control.find_control()
    if file is None:
        print(
            f"\nThe negative control is left out: ${VARIABLE} names no folder that holds it."
        )
        return {}
    result = {}
    for name, (words, options) in control.training_sets(file, folder / "twin").items():
        data = folder / f"control_{name}"
        if not data.is_dir():
            gensig.generate(*words, out=data, config_dir=options)
        models = trained(folder / f"model_{data.name}", data, *control.TRAINING)
        own = _own_score(folder / f"model_{data.name}")
        rows = control.judge_control(file, models)
        result[name] = {"own": own, "rows": rows}
        print(
            f"\nnegative control, trained on {name}; on its own unseen units {_said(own)}"
        )
        print(
            "P(fault): channel, load %: healthy, broken, difference; windows "
            "unlike the training"
        )
        for row in rows:
            _print_control(row)
    return result


def _print_control(row: Mapping[str, Any]) -> None:
    low, high = row["interval"]
    verdict = (
        "both refused"
        if row["refuses_both"]
        else "contains 0"
        if row["contains_zero"]
        else "DIFFERS"
    )
    print(
        f"  {row['channel']} {row['load']:>3} {row['fault_if_healthy']:.3f} "
        f"{row['fault_if_broken']:.3f} {row['difference']:+.3f} [{low:+.3f}, {high:+.3f}]  "
        f"{row['beyond_if_healthy']:.2f} {row['beyond_if_broken']:.2f}  {verdict}"
        f"{'' if row['channel'] == control.SCORED else ' (not scored)'}",
        flush=True,
    )


def trained(
    folder: Path, data: Path, *words: str, protocol: str = worlds.PROTOCOL
) -> list[Path]:
    """Folders of the networks, one a seed, trained on a data set where they are not there yet."""
    if not (folder / "metrics.json").is_file():
        seeds = f"seeds=[{','.join(map(str, SEEDS))}]"
        chosen = (*TRAINING, f"protocols=[{protocol}]", seeds, *words)
        status = diagnose_main(["train", f"data={data}", f"out={folder}", *chosen])
        if status != 0:
            raise ConfigError(f"diagnose train ended with status {status}")
    return [folder / "models" / f"{protocol}-seed{seed}" for seed in SEEDS]


def _own_score(folder: Path) -> dict[str, Any]:
    """Balanced accuracy of the report of a training."""
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    protocol = metrics["protocols"][worlds.PROTOCOL]
    score = protocol["methods"][metrics["model"]]["balanced_accuracy"]
    return {
        "balanced_accuracy": score["mean"],
        "interval": [score["low"], score["high"]],
        "n_units": protocol["n_units"]["test"],
    }


def _said(row: Mapping[str, Any]) -> str:
    return f"{row['balanced_accuracy']:.3f} [{row['interval'][0]:.3f}, {row['interval'][1]:.3f}]"


def _one_thread() -> Any:
    """One thread for torch and the BLAS, so that figures do not depend on a number of cores."""
    import torch
    from threadpoolctl import threadpool_limits

    torch.set_num_threads(1)
    return threadpool_limits(1)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bridge", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument(
        "--data",
        type=Path,
        help="folder of data sets and models: read where they are there, else made",
    )
    parser.add_argument(
        "--json",
        type=Path,
        help="also write all figures, with the machine, to this file",
    )
    parser.add_argument(
        "--classes",
        metavar="A,B",
        help="make sets and worlds with these classes, healthy first, and judge the networks "
        "that compare with healthy records",
    )
    parser.add_argument(
        "--networks",
        nargs="+",
        choices=NETWORKS,
        help="train and judge these alone",
    )
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        metavar="NAME=MODEL=DATA",
        help="also judge this stored network, which compares with healthy records, and the data "
        "set that it was trained on; may be repeated",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
