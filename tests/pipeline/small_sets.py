"""A data set that is made in a moment, and the bytes that make two of them equal."""

from gensig.cli import main

TINY = (
    "plan.n_records=6",
    "plan.classes=[healthy,crack]",
    "dataset.records_per_shard=1",
    "operating.duration_s=0.02",
    "sensing.channels=[pinion_y]",
)
PARTS = ("plan.csv", "index.h5", "shards/*", "splits/*")


def make(out, *overrides):
    words = [*TINY, "executor.n_workers=1", *overrides, f"out={out}"]
    assert main(["generate", "--quiet", *words]) == 0
    return out


def resume(out):
    return main(["resume", "--quiet", str(out), "--workers", "1"])


def contents(folder):
    """Bytes of every file of a data set that its bits decide, unfinished ones included."""
    paths = [path for part in PARTS for path in folder.glob(part)]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}
