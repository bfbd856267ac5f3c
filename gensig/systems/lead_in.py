"""Records that begin earlier, so that filters have settled at the first kept sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gensig.errors import SimulationError
from gensig.systems.base import Machine, simulate_together
from gensig.systems.run import CleanRecord, Run, Start


def simulate_with_lead_in(
    runs: Sequence[Run[Machine]],
) -> list[CleanRecord | SimulationError]:
    """Records of ``simulate_together`` with ``sensing.n_lead`` samples of acceleration before each.

    All other values are of the record alone, except ``contact_loss_fraction``, which counts both.
    """
    results = simulate_together([earlier(run) for run in runs])
    return [
        result if isinstance(result, SimulationError) else _cut(result, run)
        for run, result in zip(runs, results, strict=True)
    ]


def earlier(run: Run[Machine]) -> Run[Machine]:
    """The same motion from ``sensing.n_lead`` samples before its first one.

    Teeth and phase are turned back, and with them the shaft that turns a drive line.
    """
    n_lead, rate = run.system.sensing.n_lead, run.system.sensing.sampling_rate
    if n_lead == 0:
        return run
    operating, pair, lead = run.system.operating, run.system.pair, n_lead / rate
    start = run.start or Start()
    turned = operating.speed * float(operating.time_at_set_speed(np.array([-lead]))[0])
    pitches = start.phase + turned * pair.pinion.n_teeth / (2.0 * math.pi)
    teeth = math.floor(pitches)
    longer = operating.earlier(lead, (run.system.n_samples + n_lead) / rate)
    line_angle = run.system.line_angle(start)
    if line_angle is not None:
        line_angle += turned / run.system.ratio
    return replace(
        run,
        system=replace(run.system, operating=longer),
        start=Start(
            tooth_pinion=(start.tooth_pinion + teeth) % pair.pinion.n_teeth,
            tooth_wheel=(start.tooth_wheel + teeth) % pair.wheel.n_teeth,
            phase=pitches - teeth,
            line_angle=line_angle,
        ),
    )


def _cut(record: CleanRecord, run: Run[Machine]) -> CleanRecord:
    """The record from its first sample on; the acceleration keeps the lead-in."""
    n_lead, rate = run.system.sensing.n_lead, run.system.sensing.sampling_rate
    if n_lead == 0:
        return record
    n_samples = len(record.shaft_angle) - n_lead
    operating, angle = run.system.operating, record.shaft_angle
    elapsed = float(operating.time_at_set_speed(np.array([-n_lead / rate]))[0])
    before = -operating.speed * elapsed
    end = angle[0] + record.mean_speed * (n_lead + n_samples) / rate
    mesh = record.mesh
    if mesh is not None:
        mesh = mesh.since(n_lead)
    return replace(
        record,
        shaft_angle=angle[n_lead:] - before,
        mean_speed=float(end - angle[n_lead]) * rate / n_samples,
        mesh=mesh,
        further_meshes=tuple(mesh.since(n_lead) for mesh in record.further_meshes),
    )
