"""Registry of baselines by their names in ``metrics.json``, in the order of the page."""

from __future__ import annotations

from diagnose.baselines.base import Baseline, Role
from diagnose.baselines.indicator_models import (
    IndicatorModel,
    IndicatorModelWithoutLevel,
)
from diagnose.baselines.nearest_spectrum import NearestSpectrum
from diagnose.baselines.oracle import OracleIndicators
from diagnose.baselines.oracle_teeth import OracleTeeth
from diagnose.baselines.probe import MetadataProbe, ResultProbe, RotationProbe
from diagnose.baselines.rms_threshold import RmsThreshold
from diagnose.baselines.sound_record import SoundRecord
from diagnose.baselines.tooth_models import ToothLogistic

BASELINES: dict[str, type[Baseline]] = {
    baseline.text.name: baseline
    for baseline in (
        ToothLogistic,
        IndicatorModel,
        IndicatorModelWithoutLevel,
        RmsThreshold,
        NearestSpectrum,
        SoundRecord,
        MetadataProbe,
        RotationProbe,
        ResultProbe,
        OracleIndicators,
        OracleTeeth,
    )
}


def baseline_names(*roles: Role) -> tuple[str, ...]:
    """Names of the baselines of these roles."""
    return tuple(name for name, baseline in BASELINES.items() if baseline.role in roles)
