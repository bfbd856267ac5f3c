"""The command ``diagnose``: verbs, help, and one line for a mistake. Everything heavy is imported when needed."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from gensig.errors import ConfigError, DatasetError, GensigError

TRAIN_HELP = """\
Train a network and its baselines on every split of a data set and write a report.

  data=DIR    data set made by gensig generate
  out=DIR     folder to write; must not exist or be empty. Receives report.md, metrics.json, figures, models/

Every other key=value overrides configs/train.yaml, model=NAME chooses a file of configs/model."""
TRAIN_EXAMPLE = """\
examples:
  diagnose train data=runs/quickstart out=runs/report
  diagnose train data=runs/quickstart out=runs/report protocols=[by_unit] seeds=[0,1,2,3,4] epochs=30
  diagnose train -m data=runs/quickstart out=runs/levels normalise=rms,none"""
EVALUATE_HELP = """\
Evaluate a trained network on a data set.

  data=DIR         data set made by gensig generate
  model_dir=DIR    one of the folders that diagnose train wrote below models/
  out=DIR          optional: receives metrics.json and confusion.png; must not exist or be empty
  protocol=NAME    optional: judge on a part of this split of the data set
  subset=NAME      optional: which part (train, validation, test); default test

Without protocol: the test part of the network's own split on the data set it was trained on, all records elsewhere."""
EVALUATE_EXAMPLE = """\
example:
  diagnose evaluate data=runs/other model_dir=runs/report/models/by_unit-seed0"""
PREDICT_HELP = """\
Class probabilities of one recording, with a flag for what is unlike the training data.

The recording is resampled to the model's rate; one with less bandwidth is refused. It is judged in windows of the
model's length; order tracking is not there yet: take a constant speed."""
PREDICT_EXAMPLE = """\
exit status:
  0    predicted, and like the training data (or the model is too old to tell)
  2    a mistake: one line says which
  3    predicted, but out of distribution: do not rely on the class

example:
  diagnose predict --model runs/report/models/by_unit-seed0 housing.wav --channels channel_1 --speed-rpm 1500"""
OUT_OF_DISTRIBUTION = 3
EVALUATE_KEYS = ("data", "model_dir", "out", "protocol", "subset")


class _Parser(argparse.ArgumentParser):
    """Parser whose complaints are the one line of `main`."""

    def error(self, message: str) -> NoReturn:
        raise ConfigError(f"{message}; see {self.prog} --help")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; the exit status is 0, 2 for a user's mistake, 3 for `_predict`'s flag, 130 when interrupted."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        return _dispatch(words)
    except GensigError as error:
        print(f"diagnose: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"diagnose: {where}{error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("diagnose: interrupted", file=sys.stderr)
        return 130


def _dispatch(words: list[str]) -> int:
    top = _Parser(
        prog="diagnose",
        description="Train and judge fault classifiers on gensig data sets.",
        epilog="Each command has its own --help with an example.",
    )
    verbs = top.add_subparsers(dest="verb", metavar="train | evaluate | predict", parser_class=_Parser)
    verbs.add_parser("train", help="train, judge and report", add_help=False)
    verbs.add_parser("evaluate", help="judge a trained network", add_help=False)
    verbs.add_parser("predict", help="try a trained network on a recording", add_help=False)
    if not words:
        top.print_help(sys.stderr)
        return 2
    if words[0] in ("-h", "--help"):
        top.print_help()
        return 0
    commands = {"train": _train, "evaluate": _evaluate, "predict": _predict}
    if words[0] not in commands:
        raise ConfigError(f"no command '{words[0]}'; there is {', '.join(commands)}")
    return commands[words[0]](words[1:])


def _train(words: list[str]) -> int:
    parser = _verb_parser("train", TRAIN_HELP, TRAIN_EXAMPLE)
    parser.add_argument("-m", "--multirun", action="store_true", help="one run for each combination of values a,b")
    parser.add_argument("--config-dir", metavar="DIR", help="folder with groups and options of your own")
    arguments = parser.parse_intermixed_args(words)
    from gensig.compose import compose, override_keys

    if not arguments.multirun:
        override_keys(arguments.overrides)
        _train_one(compose("train", arguments.overrides, config_dir=arguments.config_dir))
        return 0
    jobs = _expand(arguments.overrides, arguments.config_dir)
    for number, config in enumerate(jobs, start=1):
        print(f"run {number} of {len(jobs)}: {config['out']}", file=sys.stderr, flush=True)
        _train_one(config)
    return 0


def _expand(overrides: Sequence[str], config_dir: str | None) -> list[dict[str, Any]]:
    """Configurations of a multirun, each with its own ``out``; all composed before the first one runs."""
    from gensig.compose import compose, job_folders, sweep

    jobs = sweep(overrides)
    configs = [compose("train", job, config_dir=config_dir) for job in jobs]
    parents = {str(config["out"]) for config in configs}
    if len(parents) > 1:
        raise ConfigError("out must be one folder; with -m each run gets a folder below it")
    parent = Path(parents.pop())
    _refuse_existing(parent)
    return [{**config, "out": str(parent / name)} for config, name in zip(configs, job_folders(jobs), strict=True)]


def _train_one(config: dict[str, Any]) -> None:
    from diagnose.settings import settings_from

    settings = settings_from(config)
    out = Path(settings.out)
    _refuse_existing(out)
    from diagnose.progress import progress
    from diagnose.report import result_table, write_report
    from diagnose.study import plan_study, run_study, task_from
    from gensig.dataset.reader import open_dataset

    task = task_from(open_dataset(settings.data), settings)
    protocols, jobs = plan_study(task, settings)
    out.mkdir(parents=True, exist_ok=True)
    with progress(len(jobs)) as on_done:
        metrics = run_study(task, settings, out, protocols=protocols, jobs=jobs, on_done=on_done)
    page = write_report(out, metrics)
    print("\n".join(result_table(metrics)))
    print(f"report: {page}")


def _evaluate(words: list[str]) -> int:
    arguments = _verb_parser("evaluate", EVALUATE_HELP, EVALUATE_EXAMPLE).parse_intermixed_args(words)
    values = _key_values(arguments.overrides)
    out = Path(values["out"]) if "out" in values else None
    if out is not None:
        _refuse_existing(out)
    from diagnose.evaluate import evaluate_model, write_evaluation
    from diagnose.model_io import load_model
    from gensig.dataset.reader import open_dataset

    model, description = load_model(values["model_dir"])
    dataset = open_dataset(values["data"])
    protocol, subset = values.get("protocol"), values.get("subset")
    result = evaluate_model(model, description, dataset, protocol=protocol, subset=subset)
    print(f"{result['n_records']} records of {result['n_units']} unit(s): {result['part']}")
    for name in ("balanced_accuracy", "macro_f1"):
        score = result[name]
        print(f"{name} {score['mean']:.3f}, 95 % interval over units {score['low']:.3f} to {score['high']:.3f}")
    for name, share in result["recall"].items():
        print(f"recall {name} {share:.3f}")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_evaluation(out, result)
    return 0


def _predict(words: list[str]) -> int:
    parser = _Parser(
        prog="diagnose predict",
        description=PREDICT_HELP,
        epilog=PREDICT_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("recording", metavar="RECORDING", help=".csv, .wav, .npy, .npz, .h5, .hdf5 or .mat")
    parser.add_argument("--model", required=True, metavar="DIR", help="folder that diagnose train wrote below models/")
    parser.add_argument("--sampling-rate", type=float, metavar="HZ", help="samples a second, where the file is silent")
    parser.add_argument("--speed-rpm", type=float, metavar="RPM", help="of the driving shaft: was it trained at such?")
    parser.add_argument("--channels", nargs="+", metavar="NAME", help="for the model's channels, in their order")
    parser.add_argument("--unit", default="m/s2", help="m/s2 or g, where the column does not say (default: m/s2)")
    parser.add_argument("--array", metavar="NAME", help="array of a .npz, .h5 or .mat file (default: acceleration)")
    parser.add_argument("--json", action="store_true", help="print everything, window by window, as JSON")
    arguments = parser.parse_args(words)
    from diagnose.model_io import load_domain, load_model
    from diagnose.predict import Source, predict_recording, summary

    source = Source(
        file=arguments.recording,
        sampling_rate=arguments.sampling_rate,
        speed_rpm=arguments.speed_rpm,
        channels=None if arguments.channels is None else tuple(arguments.channels),
        unit=arguments.unit,
        array=arguments.array,
    )
    model, description = load_model(arguments.model)
    result = predict_recording(model, description, load_domain(arguments.model, description), source)
    if arguments.json:
        import json

        print(json.dumps({"model": arguments.model, **result}, indent=2, allow_nan=False))
    else:
        print(summary(result))
    return OUT_OF_DISTRIBUTION if result["out_of_distribution"] else 0


def _verb_parser(verb: str, description: str, epilog: str) -> _Parser:
    parser = _Parser(
        prog=f"diagnose {verb}",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("overrides", nargs="*", metavar="key=value", help="see above")
    return parser


def _key_values(words: Sequence[str]) -> dict[str, str]:
    """Words of the form key=value as a dictionary; refuses others, unknown keys and missing ones."""
    values: dict[str, str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not value:
            raise ConfigError(f"'{word}' is not of the form key=value")
        if key not in EVALUATE_KEYS:
            close = difflib.get_close_matches(key, EVALUATE_KEYS, n=1)
            hint = f"did you mean {close[0]}?" if close else f"there is {', '.join(EVALUATE_KEYS)}"
            raise ConfigError(f"unknown key '{key}'; {hint}")
        if key in values:
            raise ConfigError(f"{key} is given twice")
        values[key] = value
    for key in ("data", "model_dir"):
        if key not in values:
            raise ConfigError(f"{key} is required: give {key}=DIR")
    return values


def _refuse_existing(folder: Path) -> None:
    """Refuse an output folder that holds anything; touches nothing."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        raise DatasetError(f"out={folder} exists and is not an empty folder; choose another or remove it")


if __name__ == "__main__":
    sys.exit(main())
