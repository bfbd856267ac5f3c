"""The tooth of a recording that a network accuses, with what shows why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch

from diagnose.data.packed_turns import tooth_counts
from diagnose.data.targets import GEARS
from diagnose.data.turns import Turns
from diagnose.data.windows import HEALTHY, FloatArray
from diagnose.networks.network import SiteNetwork
from diagnose.recordings.prepared import prepare_recording
from diagnose.recordings.source import Source
from diagnose.recordings.stored_network import require_finite
from diagnose.report.tooth_figure import AccusedTooth
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from diagnose.data.windows import WindowSet
    from diagnose.recordings.stored_network import StoredNetwork

NO_TEETH = "--plot shows the teeth of a gear, which this model does not score: model=tooth does"


def accused_tooth(network: StoredNetwork, source: Source) -> AccusedTooth:
    """The most suspicious tooth of a recording, whatever its class.

    Raises
    ------
    ConfigError    for a network that scores no teeth, and as `prepare_recording`
    """
    inputs = network.inputs()
    if not (isinstance(network.model, SiteNetwork) and isinstance(inputs, Turns)):
        raise ConfigError(NO_TEETH)
    prepared = prepare_recording(network.description, inputs, source)
    return accused_of_turns(network, prepared.windows, prepared.channels)


def accused_of_turns(
    network: StoredNetwork, turns: WindowSet, channels: Sequence[str]
) -> AccusedTooth:
    """The most suspicious tooth of packed turns of one record.

    Parameters
    ----------
    turns : one input, or one a channel for a network that looks at each by itself
    channels : names of the channels of all inputs, one after the other

    Raises
    ------
    ConfigError    for a network that scores no teeth
    """
    model, inputs = network.model, network.inputs()
    if not (isinstance(model, SiteNetwork) and isinstance(inputs, Turns)):
        raise ConfigError(NO_TEETH)
    windows = torch.from_numpy(turns.cut(np.arange(len(turns))))
    with torch.inference_mode():
        scores = model.site_scores(windows)
        entries = model.entries(windows).tolist()
    require_finite(tooth_scores=scores.numpy())
    names = network.description.class_names
    odds = np.mean([_log_odds(of_input, names) for of_input in scores], axis=0)
    sites = model.sites(tooth_counts(turns.signals[0]))
    gears = np.array([gear for gear, _ in sites])
    teeth = np.array([tooth for _, tooth in sites])
    log_odds = {gear: odds[(gears == gear) & (teeth >= 0)] for gear in GEARS[1:]}
    gear = max(log_odds, key=lambda name: float(log_odds[name].max()))
    tooth = int(log_odds[gear].argmax())
    of_inputs = zip(turns.signals, entries, strict=True)
    turn = np.concatenate(
        [inputs.of_gear(signal, gear, entry) for signal, entry in of_inputs]
    )
    apart = turn[:, tooth] - turn.mean(axis=1)
    spread = turn.std(axis=1).mean(axis=1)
    channel = int((np.square(apart).mean(axis=1) / (spread**2 + 1e-30)).argmax())
    return AccusedTooth(
        gear=gear,
        tooth=tooth,
        channel=channels[channel],
        turn=turn[channel],
        log_odds=log_odds,
    )


def _log_odds(scores: torch.Tensor, class_names: tuple[str, ...]) -> FloatArray:
    """(site,) log of the odds that a fault is there, from scores (site, class)."""
    probability = torch.softmax(scores.flatten(), dim=0).view_as(scores).double()
    faulty = [index for index, name in enumerate(class_names) if name != HEALTHY]
    at_site = probability[:, faulty].sum(dim=1).numpy()
    tiny = np.finfo(float).tiny
    return np.log(at_site + tiny) - np.log1p(-np.minimum(at_site, 1 - 1e-12))
