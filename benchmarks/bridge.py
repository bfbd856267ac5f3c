"""``python -m benchmarks.bridge``: does adapting a network by healthy recordings help, and what
does it break?

Trains the default network in one simulated world, adapts it to others by their healthy records
alone (`diagnose.networks.adaptation`) and judges it on units that took no part; beside it the
naive variants, which match all classes of the training to healthy records, and a network
trained in the other world with labels. Then the negative control: recordings of two states that
differ in the mounting, read from the folder ``$GENSIG_MEASURED`` where it is set.
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
from benchmarks import _bridge_worlds as worlds
from benchmarks._measure import machine, print_machine
from benchmarks._realism_recording import VARIABLE
from diagnose.cli import main as diagnose_main
from gensig.errors import ConfigError, GensigError

TRAINING = (
    "model=cnn",
    "protocols=[by_unit]",
    "baselines=false",
    "shuffle_control=false",
)
SEEDS = (0, 1, 2)
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
            result = {
                "worlds": judge_worlds(Path(folder)),
                "control": judge_control(Path(folder)),
            }
    except (GensigError, OSError) as error:
        print(f"benchmarks.bridge: {error}", file=sys.stderr)
        return 1
    print(f"\n{time.perf_counter() - begun:.0f} s")
    if options.json:
        told = {key: named[key] for key in TOLD}
        text = json.dumps({"machine": told, "seeds": SEEDS, **result}, indent=1)
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


def judge_worlds(folder: Path) -> dict[str, Any]:
    """Scores in each world, of every variant."""
    source = worlds.open_world(folder / "source", worlds.SOURCE)
    models = trained(folder / "model", folder / "source")
    result = {"source": _own_score(folder / "model")}
    print(f"\nin its own world, unseen units: {_said(result['source'])}", flush=True)
    for name, words in worlds.WORLDS.items():
        world = worlds.open_world(folder / name, words)
        judged = worlds.judge_world(source, world, models)
        table = worlds.scores(judged, source.class_names)
        trained(folder / f"model_{name}", folder / name)
        there = _own_score(folder / f"model_{name}")
        n_units = len(set(judged.unit.tolist()))
        print(
            f"\n{name}: {judged.label.size} records of {n_units} units, "
            f"{judged.n_windows} healthy windows to adapt by"
        )
        for variant, row in table.items():
            gain = (
                f"{row['gain']:+.3f} [{row['gain_interval'][0]:+.3f}, "
                f"{row['gain_interval'][1]:+.3f}]"
            )
            print(
                f"  {variant:<24}{_said(row)}  gain {gain}  auroc {row['auroc']:.3f}  "
                f"healthy found {row['recall'][worlds.HEALTHY]:.2f}"
            )
        print(
            f"  {'trained there':<24}{_said(there)} on its own test units", flush=True
        )
        result[name] = {
            "n_records": judged.label.size,
            "n_units": n_units,
            "variants": table,
            "trained_there": there,
        }
    return result


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
            "P(fault): channel, load %, variant: healthy, broken, difference; windows "
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
        f"  {row['channel']} {row['load']:>3} {row['variant']:<8}{row['fault_if_healthy']:.3f} "
        f"{row['fault_if_broken']:.3f} {row['difference']:+.3f} [{low:+.3f}, {high:+.3f}]  "
        f"{row['beyond_if_healthy']:.2f} {row['beyond_if_broken']:.2f}  {verdict}"
        f"{'' if row['channel'] == control.SCORED else ' (not scored)'}",
        flush=True,
    )


def trained(folder: Path, data: Path, *words: str) -> list[Path]:
    """Folders of the networks, one a seed, trained on a data set where they are not there yet."""
    if not (folder / "metrics.json").is_file():
        seeds = f"seeds=[{','.join(map(str, SEEDS))}]"
        status = diagnose_main(
            ["train", f"data={data}", f"out={folder}", *TRAINING, seeds, *words]
        )
        if status != 0:
            raise ConfigError(f"diagnose train ended with status {status}")
    return [folder / "models" / f"{worlds.PROTOCOL}-seed{seed}" for seed in SEEDS]


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
    """One thread for torch and the BLAS.

    Adapted networks are the same on every machine's number of cores.
    """
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
    return parser


if __name__ == "__main__":
    sys.exit(main())
