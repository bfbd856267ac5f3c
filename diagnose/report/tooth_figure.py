"""Picture of an accused tooth: its turn, its passage over its sisters, the odds of all teeth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnose.data.windows import FloatArray
from diagnose.report.panels import COLORS, panels, save

SISTERS = "0.75"  # gray


@dataclass(frozen=True, slots=True, kw_only=True)
class AccusedTooth:
    """The tooth with the largest odds of a fault, and its gear.

    Attributes
    ----------
    gear : of `diagnose.data.targets.GEARS`
    tooth : counted from the first that comes into mesh
    channel : name of the channel in which it differs most from the other teeth
    turn : (tooth, sample) mean turn of the gear in that channel, m/s^2; each tooth from its entry
    log_odds : gear -> (tooth,) natural log of the odds of a fault of each tooth
    """

    gear: str
    tooth: int
    channel: str
    turn: FloatArray
    log_odds: dict[str, FloatArray]


def tooth_figure(path: Path, accused: AccusedTooth, title: str) -> None:
    """Write a PNG of three panels."""
    figure, (turn, passage, odds) = panels(3, 4.2, 3.4)
    n_teeth, n_samples = accused.turn.shape
    at = np.arange(n_teeth * n_samples) / n_samples
    turn.plot(at, accused.turn.ravel(), color="0.3", linewidth=0.5)
    turn.axvspan(accused.tooth, accused.tooth + 1, color=COLORS[1], alpha=0.35)
    turn.set(
        xlabel=f"teeth of the {accused.gear}, from the first in mesh",
        ylabel=f"{accused.channel}, m/s$^2$",
        title="mean turn",
    )
    place = np.arange(n_samples) / n_samples
    sisters = np.delete(accused.turn, accused.tooth, axis=0)
    passage.plot(place, sisters.T, color=SISTERS, linewidth=0.6)
    passage.plot(
        place,
        accused.turn[accused.tooth],
        color=COLORS[1],
        label=f"tooth {accused.tooth}",
    )
    passage.set(
        xlabel="base pitches from its entry", title="the tooth over its sisters"
    )
    passage.legend(loc="upper left", fontsize=8)
    for index, (gear, values) in enumerate(accused.log_odds.items()):
        odds.plot(
            values, color=COLORS[2 * index], marker=".", linewidth=0.6, label=gear
        )
    odds.axhline(0.0, color="0.4", linestyle=":")
    odds.set(xlabel="tooth", ylabel="log-odds of a fault", title="all teeth")
    odds.legend(loc="upper right", fontsize=8)
    figure.suptitle(title, fontsize=10)
    save(figure, path)
