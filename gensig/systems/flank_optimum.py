"""Flank modifications that are best for a range of torques and misalignments.

Least ripple, least load, and between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, GeometryError
from gensig.mesh.modification import FlankModification, PairModification
from gensig.mesh.sliced.slices import loaded_contact
from gensig.systems.sliced_pair import SlicedPair

Array = NDArray[np.float64]

# of the search, in normal modules: depth and height as the paper on transmission error takes
# them, section 2
LARGEST_DEPTH, LARGEST_HEIGHT = 0.02, 0.65
N_VARIABLES = 9  # tip and root relief, each with depth and height, of both gears; crowning of the pair
N_PHASES, N_SLICES = (
    32,
    28,
)  # of the search; what it finds is judged with the pair's own
POPULATION, GENERATIONS = (
    8,
    60,
)  # of differential evolution; the population counts for each variable
BETWEEN = (
    0.5  # of these generations where a search starts from the front of those before
)
REFUSED = 1e3  # times the unmodified value, for flanks that overlap or lose contact


@dataclass(frozen=True, slots=True, kw_only=True)
class Cases:
    """What a modification must be good for.

    Every torque (N m) with every misalignment (m over the face).
    """

    torques: tuple[float, ...]
    misalignments: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.torques or not all(torque > 0.0 for torque in self.torques):
            raise ConfigError(f"torques {self.torques} must be positive, at least one")
        if not self.misalignments:
            raise ConfigError("misalignments: give at least one, 0 for none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """A modification with the worst of all cases: ripple (m, peak to peak) and line load (N/m)."""

    modification: PairModification
    ripple: float
    line_load: float


def judge(
    system: SlicedPair,
    modification: PairModification,
    cases: Cases,
    *,
    n_phases: int = 64,
) -> Optimum:
    """Worst ripple and worst line load over the cases.

    The modification's own misalignment is added to theirs.
    """
    ripple, line_load = 0.0, 0.0
    for misalignment in cases.misalignments:
        askew = replace(
            modification, misalignment=modification.misalignment + misalignment
        )
        mesh = replace(system, modification=askew).sliced_mesh()
        for torque in cases.torques:
            contact = loaded_contact(
                mesh, system.phases(n_phases), torque / system.pair.pinion.base_radius
            )
            ripple = max(ripple, float(np.ptp(contact.approach)))
            line_load = max(line_load, float(contact.line_load.max()))
    return Optimum(modification=modification, ripple=ripple, line_load=line_load)


def optimise(
    system: SlicedPair,
    cases: Cases,
    *,
    n_front: int,
    seed: int = 0,
    generations: int = GENERATIONS,
    on_done: Callable[[int, int], None] = lambda done, total: None,
) -> list[Optimum]:
    """Modifications from the least ripple to the least line load.

    Parameters
    ----------
    system : its own modification is replaced; slices and mesh law are kept
    n_front : 1 for the least ripple alone, 2 for it and the least line load, more for points between: the least ripple
        under a bound on the line load (epsilon constraint), so also where the front is hollow; of all that was tried,
        what nothing beats is spread over the front
    seed : of the search; the same seed gives the same result

    Returns
    -------
    optima that none of the others beats in both, by rising ripple

    Source: differential evolution of Storn & Price (1997) as
    ``scipy.optimize.differential_evolution`` has it.
    """
    search = replace(
        system,
        slices=replace(system.slices, n_slices=min(N_SLICES, system.slices.n_slices)),
    )
    plain = judge(search, _plain(), cases, n_phases=N_PHASES)
    seen: dict[bytes, tuple[float, float]] = {}

    def values(point: Array) -> tuple[float, float]:
        """Ripple and line load over those of plain flanks."""
        key = point.tobytes()
        if key not in seen:
            try:
                found = judge(search, unpacked(point, search), cases, n_phases=N_PHASES)
                seen[key] = (
                    found.ripple / plain.ripple,
                    found.line_load / plain.line_load,
                )
            except (ConfigError, GeometryError):
                seen[key] = REFUSED, REFUSED
        return seen[key]

    def run(
        objective: Callable[[Array], float],
        start: Sequence[Array],
        number: int,
        n_generations: int,
    ) -> Array:
        point = _minimum(
            objective, start, seed=seed + number, generations=n_generations
        )
        on_done(number + 1, n_front)
        return point

    points = [
        run(lambda point: values(point)[0], [np.zeros(N_VARIABLES)], 0, generations)
    ]
    if n_front > 1:
        points.append(
            run(
                lambda point: values(point)[1],
                [np.zeros(N_VARIABLES), points[0]],
                1,
                generations,
            )
        )
        most, least = values(points[0])[1], values(points[1])[1]
        for number, bound in enumerate(
            np.linspace(most, least, n_front)[1:-1], start=2
        ):

            def bounded(point: Array, bound: float = float(bound)) -> float:
                ripple, load = values(point)
                return ripple + 100.0 * max(load / bound - 1.0, 0.0)

            run(
                bounded,
                _spread(seen, POPULATION * N_VARIABLES // 2),
                number,
                math.ceil(BETWEEN * generations),
            )
        points = _spread(seen, n_front)
    found = [judge(system, unpacked(point, system), cases) for point in points]
    return _not_beaten(found)


def _spread(seen: Mapping[bytes, tuple[float, float]], n_points: int) -> list[Array]:
    """Points of all that were tried that no other beats, at most so many, spread evenly over the
    front's length.
    """
    order = sorted(seen, key=lambda key: seen[key])
    front = [order[0]]
    for key in order:
        if seen[key][1] < seen[front[-1]][1]:
            front.append(key)
    value = np.array([seen[key] for key in front])
    size = np.maximum(np.ptp(value, axis=0), 1e-12)
    along = np.append(0.0, np.cumsum(np.hypot(*(np.diff(value, axis=0) / size).T)))
    wanted = np.linspace(0.0, along[-1], n_points)
    chosen = np.unique(np.abs(along[:, None] - wanted).argmin(axis=0))
    return [np.frombuffer(front[place]) for place in chosen.tolist()]


def _minimum(
    objective: Callable[[Array], float],
    start: Sequence[Array],
    *,
    seed: int,
    generations: int,
) -> Array:
    """Best point of the unit box, (variable,), from a random population that holds the given
    ones.
    """
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    population = qmc.LatinHypercube(
        N_VARIABLES, rng=np.random.default_rng(seed)
    ).random(POPULATION * N_VARIABLES)
    population[: len(start)] = start
    result = differential_evolution(
        objective,
        [(0.0, 1.0)] * N_VARIABLES,
        init=population,
        maxiter=generations,
        tol=1e-4,
        polish=False,
        rng=np.random.default_rng([seed, 1]),
    )
    return np.asarray(result.x, dtype=np.float64)


def unpacked(point: Array, system: SlicedPair) -> PairModification:
    """Modification of a point of the unit box; a relief of no height has no depth."""
    module = system.pair.pinion.normal_module
    depth, height = LARGEST_DEPTH * module, LARGEST_HEIGHT * module
    sides = []
    for tip, tip_height, root, root_height in (point[:4], point[4:8]):
        sides.append(
            FlankModification(
                tip_relief=depth * tip if tip_height > 0.0 else 0.0,
                tip_relief_height=height * tip_height,
                root_relief=depth * root if root_height > 0.0 else 0.0,
                root_relief_height=height * root_height,
            )
        )
    crowned = replace(sides[0], crowning=depth * float(point[8]))
    return PairModification(pinion=crowned, wheel=sides[1])


def _plain() -> PairModification:
    return PairModification(pinion=FlankModification(), wheel=FlankModification())


def _not_beaten(found: Sequence[Optimum]) -> list[Optimum]:
    """Those that no other is at least as good as in both and better in one, by rising ripple."""
    kept = [
        one
        for one in found
        if not any(
            other.ripple <= one.ripple
            and other.line_load <= one.line_load
            and (other.ripple, other.line_load) != (one.ripple, one.line_load)
            for other in found
        )
    ]
    return sorted(
        {(one.ripple, one.line_load): one for one in kept}.values(),
        key=lambda one: one.ripple,
    )
