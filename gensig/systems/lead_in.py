"""Records that begin earlier, so that the filters behind them have settled at the first sample
that is kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gensig.dynamics.mesh_state import MeshState
from gensig.errors import SimulationError
from gensig.systems.base import Machine, simulate_together
from gensig.systems.run import CleanRecord, Run, Start


def simulate_with_lead_in(
    runs: Sequence[Run[Machine]],
) -> list[CleanRecord | SimulationError]:
    """As ``simulate_together``, but every acceleration has its ``sensing.n_lead`` samples before
    the record too.

    All else that a record tells is of the record alone, but for ``contact_loss_fraction``, which
    counts both.
    """
    results = simulate_together([earlier(run) for run in runs])
    return [
        result if isinstance(result, SimulationError) else _cut(result, run)
        for run, result in zip(runs, results, strict=True)
    ]


def earlier(run: Run[Machine]) -> Run[Machine]:
    """The same motion from ``sensing.n_lead`` samples before its first one.

    Teeth and phase turned back.
    """
    n_lead = run.system.sensing.n_lead
    if n_lead == 0:
        return run
    operating, pair, rate = (
        run.system.operating,
        run.system.pair,
        run.system.sensing.sampling_rate,
    )
    lead = n_lead / rate
    start = run.start or Start()
    turned = operating.speed * float(operating.time_at_set_speed(np.array([-lead]))[0])
    pitches = start.phase + turned * pair.pinion.n_teeth / (2.0 * math.pi)
    teeth = math.floor(pitches)
    longer = operating.earlier(lead, (round(operating.duration * rate) + n_lead) / rate)
    return replace(
        run,
        system=replace(run.system, operating=longer),
        start=Start(
            tooth_pinion=(start.tooth_pinion + teeth) % pair.pinion.n_teeth,
            tooth_wheel=(start.tooth_wheel + teeth) % pair.wheel.n_teeth,
            phase=pitches - teeth,
        ),
    )


def _cut(record: CleanRecord, run: Run[Machine]) -> CleanRecord:
    """What the record tells, from its own first sample on; the acceleration stays whole."""
    n_lead, rate = run.system.sensing.n_lead, run.system.sensing.sampling_rate
    if n_lead == 0:
        return record
    n_samples = len(record.shaft_angle) - n_lead
    operating = run.system.operating
    before = -operating.speed * float(
        operating.time_at_set_speed(np.array([-n_lead / rate]))[0]
    )
    end = record.shaft_angle[0] + record.mean_speed * (n_lead + n_samples) / rate
    return replace(
        record,
        shaft_angle=record.shaft_angle[n_lead:] - before,
        mean_speed=float(end - record.shaft_angle[n_lead]) * rate / n_samples,
        mesh=None if record.mesh is None else _cut_mesh(record.mesh, n_lead),
    )


def _cut_mesh(mesh: MeshState, n_lead: int) -> MeshState:
    return MeshState(
        pinion_tooth=mesh.pinion_tooth[:, n_lead:],
        wheel_tooth=mesh.wheel_tooth[:, n_lead:],
        load_share=mesh.load_share[:, n_lead:],
        force=mesh.force[n_lead:],
        contact_lost=mesh.contact_lost[n_lead:],
        fault_engaged=mesh.fault_engaged[n_lead:],
    )
