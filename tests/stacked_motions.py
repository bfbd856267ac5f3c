"""Motions of machines as arrays with the machines along the first axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks._classical_scheme import Classical
from gensig.dynamics import integrator
from gensig.dynamics.backends.base import Integration, Motions


def stacked(motions: Motions) -> Motions:
    """The same motions, whose long series are views of their own, in one array each."""
    return replace(
        motions,
        acceleration=np.stack(motions.acceleration),
        angle=np.stack(motions.angle),
        seen=np.stack(motions.seen),
    )


def integrate(*arguments, **options) -> Motions:
    """``gensig.dynamics.integrator.integrate`` with the motions in arrays."""
    return stacked(integrator.integrate(*arguments, **options))


def exact_motions(
    machines, oversampling, *, with_mesh_state=False, **record
) -> Motions:
    """Motions by the classical scheme, in so many steps a sample."""
    integration = Integration(
        oversampling=oversampling,
        precision="float64",
        max_error=None,
        with_mesh_state=with_mesh_state,
        **record,
    )
    return stacked(Classical().integrate(machines, integration))
