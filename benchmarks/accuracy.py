"""``python -m benchmarks.accuracy``: integration error against 128 steps a sample.

The reference is the classical Runge-Kutta scheme of ``benchmarks._classical_scheme``.

Relative error of the spectrum from 20 Hz to 20 kHz (Hann window, worst channel) of records of
perfect gears and of gears of a quality grade; where teeth bounce for more than 1 % of the time,
third-octave levels (dB) and indicators (%) beside it. ``--json FILE`` writes the figures.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._classical_scheme import Classical
from gensig.dynamics.backends.registry import BACKENDS
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import BOUNCING
from gensig.faults.registry import fault_parts, read_faults
from gensig.plan.request import read_request
from gensig.sensing.agreement import agreement
from gensig.sensing.manufacturing import draw_gearbox, draw_specimen
from gensig.systems.base import simulate_together
from gensig.systems.registry import read_system
from gensig.systems.run import CleanRecord, Run

FAULTS = ("healthy", "crack", "pitting", "chipped", "missing_tooth", "broken", "wear")
CONDITIONS = (
    (600, 20),
    (1800, 20),
    (1800, 2),
    (3000, 20),
    (6000, 20),
    (6000, 60),
)  # r/min, N m
REFERENCE, REFERENCE_BACKEND = 128, "classical"


def runs(overrides: Sequence[str], duration: float) -> list[tuple[str, Run]]:
    """Every fault at every condition, gears of the configured quality."""
    result = []
    for fault in FAULTS:
        for speed, torque in CONDITIONS:
            words = [
                f"fault={fault}",
                f"operating.speed_rpm={speed}",
                f"operating.torque_nm={torque}",
            ]
            config = read_request(
                [
                    *words,
                    f"operating.duration_s={duration}",
                    "solver.max_error=null",
                    *overrides,
                ]
            ).config
            system, rng = read_system(config), np.random.default_rng(1)
            n_channels = len(system.sensing.channels)
            run = Run(
                system=system,
                faults=tuple(
                    one
                    for part in fault_parts(config["fault"])
                    for one in read_faults(part, "fault")
                ),
                specimen=draw_specimen(
                    rng, system.pair.pinion, system.pair.wheel, system.quality
                ),
                gearbox=draw_gearbox(
                    rng, n_channels, system.quality, system.sensing.gain_scatter
                ),
            )
            result.append((f"{fault}, {speed} r/min, {torque} N m", run))
    return result


def finely(run: Run, oversampling: int, precision: str, backend: str | None) -> Run:
    """The same run with other steps, and by another backend where one is named."""
    solver = replace(run.system.solver, oversampling=oversampling, precision=precision)
    if backend is not None:
        solver = replace(solver, backend=backend)
    return replace(run, system=replace(run.system, solver=solver))


def records(
    all_runs: Sequence[Run],
    oversampling: int,
    precision: str,
    backend: str | None = None,
) -> list[CleanRecord]:
    """One record a run; the first that fails raises."""
    result = []
    for record in simulate_together(
        [finely(run, oversampling, precision, backend) for run in all_runs]
    ):
        if not isinstance(record, CleanRecord):
            raise record
        result.append(record)
    return result


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "overrides",
        nargs="*",
        help="configuration overrides, such as quality.iso1328_grade=null",
    )
    parser.add_argument(
        "--duration", type=float, default=0.2, help="s of each record (default 0.2)"
    )
    parser.add_argument(
        "--steps",
        type=int,
        nargs="+",
        default=[4, 5, 8],
        help="steps a sample (default 4 5 8)",
    )
    parser.add_argument("--json", help="also write the figures to this file")
    arguments = parser.parse_args()
    named = runs(arguments.overrides, arguments.duration)
    BACKENDS[REFERENCE_BACKEND] = Classical()
    exact = records([run for _, run in named], REFERENCE, "float64", REFERENCE_BACKEND)
    ways = [(n, "float64") for n in arguments.steps] + [(arguments.steps[0], "float32")]
    table: dict[str, dict[str, Any]] = {
        name: {"contact_loss": one.contact_loss_fraction}
        for (name, _), one in zip(named, exact, strict=True)
    }
    for oversampling, precision in ways:
        result = records([run for _, run in named], oversampling, precision)
        for (name, run), one, other in zip(named, result, exact, strict=True):
            rate = run.system.sensing.sampling_rate
            pair = one.acceleration[None], other.acceleration[None]
            way = f"x{oversampling} {precision}"
            table[name][way] = float(in_band_error(*pair, rate)[0])
            if other.contact_loss_fraction > BOUNCING:
                judged = agreement(*pair, rate)
                table[name][f"{way} dB"] = float(judged.third_octave_db[0])
                table[name][f"{way} %"] = 100.0 * float(judged.indicators[0])
    columns = [f"x{n} {precision}" for n, precision in ways]
    print(
        f"{'':<38}{'loss %':>8}"
        + "".join(f"{column:>13}" for column in columns)
        + "   third-octave dB, indicators %"
    )
    for name, row in table.items():
        levels = "   " + " ".join(
            f"{row[f'{c} dB']:.3f},{row[f'{c} %']:.2f}"
            for c in columns
            if f"{c} dB" in row
        )
        print(
            f"{name:<38}{100.0 * row['contact_loss']:>8.2f}"
            + "".join(f"{row[c]:>13.1e}" for c in columns)
            + levels
        )
    for column in columns:
        steady = [
            row[column] for row in table.values() if row["contact_loss"] <= BOUNCING
        ]
        print(
            f"{column}: largest error with contact lost for at most 1 % of the time "
            f"{max(steady):.1e}"
        )
    if arguments.json:
        Path(arguments.json).write_text(
            json.dumps(table, indent=1) + "\n", encoding="utf-8"
        )


if __name__ == "__main__":
    main()
