"""Figure of an engine's dampers: tooth force over speed, cycle and orders, and root stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.style import (
    FAULTY,
    SMALL,
    SOUND,
    curve,
    cycle_ticks,
    panels,
    save,
    titles,
    zero_line,
)
from gensig.commands.lines.results import (
    RPM,
    DamperState,
    heaviest_pass,
    roll_degrees,
)
from gensig.driveline.linear.dampers import TorsionalDamper

LOOKS = {"before": (FAULTY, 1.1), "after": (SOUND, 1.5)}


def plot_dampers(
    states: Mapping[str, DamperState],
    dampers: Sequence[TorsionalDamper],
    mesh: int,
    speeds: NDArray[np.float64],
    path: Path,
) -> None:
    """Draw the largest tooth force, its cycle and orders, and root stress, before and after."""
    figure, axes = panels(2, 2, 12, 7.6)
    (by_speed, by_angle), (by_order, stress) = axes
    for name, state in states.items():
        color, width = LOOKS[name]
        curve(by_speed, RPM * speeds, state.largest / 1e3, color, name, width=width)
        force, root = state.load.force, state.root
        angle = np.linspace(0.0, 720.0, len(force), endpoint=False)
        curve(by_angle, angle, force / 1e3, color, name, width=width)
        _, amplitudes = state.response.element_forces(state.line.linear()[1])
        order_force = np.abs(amplitudes[mesh]) / 1e3
        curve(by_order, state.response.orders, order_force, color, name, width=width)
        roll, constant = roll_degrees(root), root.history.stress[root.strength.decisive]
        curve(stress, roll, heaviest_pass(root) * 1e-6, color, name, width=width)
        label = f"{name}: greatest force all the way"
        curve(stress, roll, constant * 1e-6, color, label, style=":", width=0.8)
    first = states["before"]
    at_speed = f"at {RPM * first.load.speed:g} r/min"
    titles(
        by_speed, "Largest tooth force of a cycle", "speed of the crank, r/min", "kN"
    )
    by_speed.set_ylim(0.0, None)
    zero_line(by_angle)
    title = f"Tooth force {at_speed} (below 0 the teeth would part)"
    titles(by_angle, title, "crank angle, degrees", "kN")
    cycle_ticks(by_angle)
    by_angle.set_ylim(None, 1.35 * first.load.greatest / 1e3)  # room for the legend
    title = f"Tooth force by orders {at_speed}"
    titles(by_order, title, "order", "amplitude, kN", xlim=(0, 60))
    title = f"Root stress of the pair that bears most, {first.root.strength.decisive}"
    titles(stress, title, "roll of the pinion since contact begins, deg", "MPa")
    stress.margins(y=0.3)
    stress.set_ylim(0.0, None)
    by_speed.legend(fontsize=SMALL, loc="upper left")
    for panel in (by_angle, by_order, stress):
        panel.legend(fontsize=SMALL, loc="upper right")
    sizes = "; ".join(
        f"node {damper.node}: {damper.ring_inertia:.3g} kg m$^2$, "
        f"{damper.damping:.3g} N m s/rad, {damper.stiffness:.3g} N m/rad"
        for damper in dampers
    )
    name = f"{first.line.drive.name}, mesh {first.line.mesh_names[mesh]}"
    figure.suptitle(f"{name}\n{sizes}")
    save(figure, path)
