"""Figure of an engine's dampers.

Tooth force over the speeds and over a cycle, and root stress over the mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.machine_figures import FAULTY, GREY, SOUND, pyplot, save
from gensig.commands.lines.results import DamperState
from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.units import from_si

LOOKS = {"before": (FAULTY, 1.1), "after": (SOUND, 1.5)}


def plot_dampers(
    states: Mapping[str, DamperState],
    dampers: Sequence[TorsionalDamper],
    mesh: int,
    speeds: NDArray[np.float64],
    path: Path,
) -> None:
    """Worst tooth force over the run, tooth force over a cycle, orders of it, and root stress
    over the mesh.
    """
    figure, axes = pyplot.subplots(2, 2, figsize=(12, 7.6), layout="constrained")
    for name, state in states.items():
        colour, width = LOOKS[name]
        look: dict[str, Any] = {"color": colour, "linewidth": width, "label": name}
        axes[0, 0].plot(from_si("speed_rpm", 1.0) * speeds, state.largest / 1e3, **look)
        angle = np.linspace(0.0, 720.0, len(state.load.force), endpoint=False)
        axes[0, 1].plot(angle, state.load.force / 1e3, **look)
        _, amplitudes = state.response.element_forces(state.line.linear()[1])
        axes[1, 0].plot(state.response.orders, np.abs(amplitudes[mesh]) / 1e3, **look)
        root = state.root
        decisive, pair = root.strength.decisive, root.strength.pair
        roll = np.degrees(root.history.roll / pair.pinion.base_radius)
        passes = root.passes[decisive] * 1e-6
        axes[1, 1].plot(roll, passes[int(passes.max(axis=1).argmax())], **look)
        axes[1, 1].plot(
            roll,
            root.history.stress[decisive] * 1e-6,
            color=colour,
            linewidth=0.8,
            linestyle=":",
            label=f"{name}: greatest force all the way",
        )
    first = states["before"]
    rpm = from_si("speed_rpm", first.load.speed)
    axes[0, 0].set(
        title="Largest tooth force of a cycle",
        xlabel="speed of the crank, r/min",
        ylabel="kN",
    )
    axes[0, 0].set_ylim(0.0, None)
    axes[0, 1].axhline(0.0, color=GREY, linewidth=0.8)
    axes[0, 1].set(
        title=f"Tooth force at {rpm:g} r/min (below 0 the teeth would part)",
        xlabel="crank angle, degrees",
        ylabel="kN",
        xlim=(0, 720),
        xticks=range(0, 721, 90),
    )
    axes[0, 1].set_ylim(None, 1.35 * first.load.greatest / 1e3)  # room for the legend
    axes[1, 0].set(
        title=f"Tooth force by orders at {rpm:g} r/min",
        xlabel="order",
        ylabel="amplitude, kN",
        xlim=(0, 60),
    )
    gear = first.root.strength.decisive
    axes[1, 1].set(
        title=f"Root stress of the pair that bears most, {gear}",
        xlabel="roll of the pinion since contact begins, deg",
        ylabel="MPa",
    )
    axes[1, 1].margins(y=0.3)
    axes[1, 1].set_ylim(0.0, None)
    for one in axes.flat:
        one.legend(fontsize=8, loc="upper left" if one is axes[0, 0] else "upper right")
    sizes = "; ".join(
        f"node {one.node}: {one.ring_inertia:.3g} kg m$^2$, {one.damping:.3g} N m s/rad, {one.stiffness:.3g} N m/rad"
        for one in dampers
    )
    figure.suptitle(
        f"{first.line.drive.name}, mesh {first.line.mesh_names[mesh]}\n{sizes}"
    )
    save(figure, path)
