"""Figure of an engine's dampers: tooth force over speed, cycle and orders, and root stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gensig.arrays import Array
from gensig.commands.figures.panels import (
    FAULTY,
    QUARTERS,
    SOUND,
    Figure,
    Mark,
    Panel,
    across,
    curve,
)
from gensig.commands.lines.results import (
    RPM,
    DamperState,
    heaviest_pass,
    roll_degrees,
)
from gensig.driveline.linear.dampers import TorsionalDamper

LOOKS = {"before": (FAULTY, "-", 1.1), "after": (SOUND, "-", 1.5)}


def damper_figure(
    states: Mapping[str, DamperState],
    dampers: Sequence[TorsionalDamper],
    mesh: int,
    speeds: Array,
) -> Figure:
    """The largest tooth force, its cycle and orders, and root stress, before and after."""
    by_speed, by_angle, by_order, stress = _curves(states, mesh, RPM * speeds)
    first = states["before"]
    at_speed = f"at {RPM * first.load.speed:g} r/min"
    upper = [
        Panel(
            "Largest tooth force of a cycle",
            "speed of the crank, r/min",
            "kN",
            by_speed,
            legend="upper left",
            ylim=(0.0, None),
        ),
        Panel(
            f"Tooth force {at_speed} (below 0 the teeth would part)",
            "crank angle, degrees",
            "kN",
            [*by_angle, across()],
            legend="upper right",
            xlim=(0, 720),
            ticks=QUARTERS,
            ylim=(None, 1.35 * first.load.greatest / 1e3),  # room for the legend
        ),
    ]
    lower = [
        Panel(
            f"Tooth force by orders {at_speed}",
            "order",
            "amplitude, kN",
            by_order,
            xlim=(0, 60),
        ),
        Panel(
            f"Root stress of the pair that bears most, {first.root.strength.decisive}",
            "roll of the pinion since contact begins, deg",
            "MPa",
            stress,
            legend="upper right",
            margin=0.3,
            ylim=(0.0, None),
        ),
    ]
    sizes = "; ".join(
        f"node {damper.node}: {damper.ring_inertia:.3g} kg m$^2$, "
        f"{damper.damping:.3g} N m s/rad, {damper.stiffness:.3g} N m/rad"
        for damper in dampers
    )
    name = f"{first.line.drive.name}, mesh {first.line.mesh_names[mesh]}"
    return Figure([upper, lower], (12, 7.6), f"{name}\n{sizes}")


def _curves(
    states: Mapping[str, DamperState], mesh: int, rpm: Array
) -> tuple[list[Mark], ...]:
    """Curves of both states on each of the four panels."""
    by_speed: list[Mark] = []
    by_angle, by_order, stress = [], [], []
    for name, state in states.items():
        look = LOOKS[name]
        by_speed.append(curve(rpm, state.largest / 1e3, name, *look))
        force, root = state.load.force, state.root
        angle = np.linspace(0.0, 720.0, len(force), endpoint=False)
        by_angle.append(curve(angle, force / 1e3, name, *look))
        _, amplitudes = state.response.element_forces(state.line.linear()[1])
        order_force = np.abs(amplitudes[mesh]) / 1e3
        by_order.append(curve(state.response.orders, order_force, name, *look))
        roll, constant = roll_degrees(root), root.history.stress[root.strength.decisive]
        label = f"{name}: greatest force all the way"
        stress += [
            curve(roll, heaviest_pass(root) * 1e-6, name, *look),
            curve(roll, constant * 1e-6, label, look[0], ":", 0.8),
        ]
    return by_speed, by_angle, by_order, stress
