"""``diagnose score``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from diagnose.commands.parser import add_shared, show_json
from gensig.terminal.printing import remark, show

HELP = """\
Score your predictions on a data set's split, by the scorer of diagnose train.

FILE is a CSV with the columns record_id and predicted (a class name), and optional columns
protocol, method and seed, as in the predictions.csv of diagnose train. Every test record is named
once. Where the data set is a frozen benchmark, the results that ship with it are shown too."""
EXAMPLE = """\
examples:
  diagnose score --data runs/benchmark --predictions mine.csv
  diagnose score --data runs/benchmark --predictions runs/report/predictions.csv --json"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    parser.add_argument(
        "--data", required=True, metavar="DIR", help="data set made by gensig generate"
    )
    parser.add_argument(
        "--predictions",
        required=True,
        metavar="FILE",
        help="CSV: record_id, predicted, ...",
    )
    parser.add_argument(
        "--protocol",
        metavar="NAME",
        help="of a file without that column (default: by_unit)",
    )
    add_shared(parser, "--json")


def run(arguments: Namespace) -> int:
    """Print the scores.

    A benchmark that differs from the frozen one is named on stderr and not compared.
    """
    from diagnose.studies.benchmark import score_file, score_table
    from gensig.dataset.reader import open_dataset

    dataset = open_dataset(arguments.data)
    result = score_file(
        dataset, Path(arguments.predictions), protocol=arguments.protocol
    )
    if arguments.json:
        show_json([result])
        return 0
    benchmark = result["benchmark"]
    if benchmark is not None:
        for difference in benchmark["differences"]:
            remark("diagnose", f"not comparable with {benchmark['name']}: {difference}")
        if not benchmark["differences"]:
            show(f"{benchmark['name']}: plan, splits and signals are the frozen ones")
    show(*score_table(result))
    return 0
