"""Registry of baselines by their names in ``metrics.json``, in the order of the page."""

from __future__ import annotations

from diagnose.baselines.base import Baseline, Role
from diagnose.baselines.indicator_models import (
    IndicatorModel,
    IndicatorModelWithoutLevel,
)
from diagnose.baselines.minirocket import MiniRocket
from diagnose.baselines.nearest_spectrum import NearestSpectrum
from diagnose.baselines.oracle import OracleIndicators
from diagnose.baselines.probe import MetadataProbe, ResultProbe
from diagnose.baselines.reference import Reference
from diagnose.baselines.rms_threshold import RmsThreshold

BASELINES: dict[str, type[Baseline]] = {
    baseline.text.name: baseline
    for baseline in (
        IndicatorModel,
        IndicatorModelWithoutLevel,
        RmsThreshold,
        NearestSpectrum,
        MiniRocket,
        Reference,
        MetadataProbe,
        ResultProbe,
        OracleIndicators,
    )
}


def baseline_names(*roles: Role) -> tuple[str, ...]:
    """Names of the baselines of these roles."""
    return tuple(name for name, baseline in BASELINES.items() if baseline.role in roles)
