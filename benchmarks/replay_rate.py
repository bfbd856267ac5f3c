"""Windows a second that reach a training loop: ``python -m benchmarks.replay_rate``.

Windows of 4,096 samples of records of 1 s and four channels (``experiment=quickstart``), by a
loader of two workers. A rate is that of a whole pass, from the start of the workers to the last
batch: the first records and all others are simulated in that time. The best of several passes
is printed, beside the rate of new records without any reuse.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from torch.utils.data import DataLoader

import gensig
from benchmarks._measure import begin, least, print_figures, write_json
from diagnose.data import (
    AddNoise,
    ChooseChannels,
    Compose,
    DropChannels,
    Gain,
    ReplayStream,
    Resample,
    Shift,
    StreamingDataset,
)

N_WORKERS, BATCH, REUSE = 2, 64, 16
CUT = {"window_samples": 4096, "stride_samples": 4096}
GOAL = 2000.0  # windows a second at reuse 16
N_TIMED = 64  # records whose simulation is timed
TRANSFORMS = {
    "crop alone": None,
    "crop, noise, gain": Compose([AddNoise((10, 40)), Gain((-6, 6))]),
    "crop, noise, gain, one sensor": Compose(
        [ChooseChannels(1), AddNoise((10, 40)), Gain((-6, 6))]
    ),
    "crop, all transforms": Compose(
        [
            Resample((0.97, 1.03)),
            AddNoise((10, 40), "pink"),
            Gain((-6, 6)),
            Shift(500),
            DropChannels(0.2),
        ]
    ),
}


def best_rate(loader: Iterable[Any], runs: int) -> tuple[float, int]:
    """Most windows a second of several passes, and the windows of one."""
    rates = []
    for _ in range(runs):
        start = time.perf_counter()
        n_windows = sum(len(windows) for windows, _ in loader)
        rates.append(n_windows / (time.perf_counter() - start))
    return max(rates), n_windows


def streamed(stream: Any, runs: int) -> dict[str, float]:
    """Rates without reuse: every window is of a new record."""
    windows = StreamingDataset(stream, **CUT)
    loader = DataLoader(windows, batch_size=BATCH, num_workers=N_WORKERS)
    rate, n_windows = best_rate(loader, runs)
    return {"windows/s": rate, "new records/s": rate * len(stream) / n_windows}


def replayed(stream: Any, transform: Any, runs: int) -> dict[str, float]:
    """Rates with reuse."""
    windows = ReplayStream(
        stream, **CUT, reuse=REUSE, batch_size=BATCH, transform=transform
    )
    loader = DataLoader(windows, batch_size=None, num_workers=N_WORKERS)
    rate, n_windows = best_rate(loader, runs)
    return {
        "windows/s": rate,
        "new records/s": rate * len(stream) / n_windows,
        "windows/s over the goal": rate / GOAL,
    }


def main() -> None:
    """Measure and print."""
    arguments, named, _ = begin("benchmarks.replay_rate", __doc__ or "")
    n_timed, words, transforms = N_TIMED, (), TRANSFORMS
    if arguments.quick:
        n_timed, words = 8, ("plan.n_records=8", "operating.duration_s=0.1")
        transforms = {"crop alone": None}
    stream = gensig.stream("experiment=quickstart", *words)
    part = stream.take(range(n_timed))
    list(part)  # compiles
    spent = least(lambda: list(part), arguments.runs) / n_timed
    sections = {
        "one process": {
            "CPU s a new record": spent,
            "new records per core-s": 1 / spent,
        },
        f"StreamingDataset, {N_WORKERS} workers": streamed(stream, arguments.runs),
    }
    for section, values in sections.items():
        print_figures(section, values)
    for name, transform in transforms.items():
        section = f"ReplayStream, reuse {REUSE}, {N_WORKERS} workers: {name}"
        sections[section] = replayed(stream, transform, arguments.runs)
        print_figures(section, sections[section])
    write_json(arguments.json, named, sections)


if __name__ == "__main__":
    main()
