"""Optimal flank modifications for a range of torques and misalignments.

From the least ripple to the least line load.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, GeometryError
from gensig.mesh.modification import PLAIN, FlankModification, PairModification
from gensig.mesh.sliced.slices import loaded_contact
from gensig.systems.sliced_pair import SlicedPair

# of the search, in normal modules: depth and height of section 2 of the paper on transmission
# error
LARGEST_DEPTH, LARGEST_HEIGHT = 0.02, 0.65
# tip and root relief, each with depth and height, of both gears; crowning of the pair
N_VARIABLES = 9
N_PHASES, N_SLICES = (
    32,
    28,
)  # of the search; results are judged with the slices of the pair
POPULATION, GENERATIONS = (
    8,
    60,
)  # of differential evolution; the population for each variable
BETWEEN = 0.5  # share of the generations for searches that start from the front of former ones
REFUSED = 1e3  # times the unmodified value, for flanks that overlap or lose contact


@dataclass(frozen=True, slots=True, kw_only=True)
class Cases:
    """Load cases: every torque (N m) with every misalignment (m over the face)."""

    torques: tuple[float, ...]
    misalignments: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.torques or not all(torque > 0.0 for torque in self.torques):
            raise ConfigError(f"torques {self.torques} must be positive, at least one")
        if not self.misalignments:
            raise ConfigError("misalignments: give at least one, 0 for none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """A modification with its worst ripple (m, peak to peak) and line load (N/m) of all cases."""

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
        total = modification.misalignment + misalignment
        askew = replace(modification, misalignment=total)
        mesh = replace(system, modification=askew).sliced_mesh()
        for torque in cases.torques:
            force = torque / system.pair.pinion.base_radius
            contact = loaded_contact(mesh, system.phases(n_phases), force)
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
    system : its modification is replaced; slices and mesh law are kept
    n_front : 1 for the least ripple alone, 2 for it and the least line load, more for points
        between. These are the least ripple under a bound on the line load (epsilon constraint),
        which also finds hollow fronts. The result is spread over the non-dominated points of all
        searches
    seed : of the search; the same seed gives the same result

    Returns
    -------
    non-dominated optima by rising ripple

    Source: differential evolution of Storn & Price (1997) as
    ``scipy.optimize.differential_evolution`` has it.
    """
    n_slices = min(N_SLICES, system.slices.n_slices)
    search = replace(system, slices=replace(system.slices, n_slices=n_slices))
    plain = judge(search, PLAIN, cases, n_phases=N_PHASES)
    seen: dict[bytes, tuple[float, float]] = {}

    def values(point: Array) -> tuple[float, float]:
        """Ripple and line load over those of plain flanks."""
        key = point.tobytes()
        if key not in seen:
            try:
                trial = judge(search, unpacked(point, search), cases, n_phases=N_PHASES)
                load = trial.line_load / plain.line_load
                seen[key] = trial.ripple / plain.ripple, load
            except (ConfigError, GeometryError):
                seen[key] = REFUSED, REFUSED
        return seen[key]

    def ripple(point: Array) -> float:
        return values(point)[0]

    def line_load(point: Array) -> float:
        return values(point)[1]

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

    zero = np.zeros(N_VARIABLES)
    points = [run(ripple, [zero], 0, generations)]
    if n_front > 1:
        points.append(run(line_load, [zero, points[0]], 1, generations))
        most, least = line_load(points[0]), line_load(points[1])
        fewer = math.ceil(BETWEEN * generations)
        bounds = np.linspace(most, least, n_front)[1:-1].tolist()
        for number, bound in enumerate(bounds, start=2):

            def bounded(point: Array, bound: float = bound) -> float:
                excess = max(line_load(point) / bound - 1.0, 0.0)
                return ripple(point) + 100.0 * excess

            start = _spread(seen, POPULATION * N_VARIABLES // 2)
            run(bounded, start, number, fewer)
        points = _spread(seen, n_front)
    optima = [judge(system, unpacked(point, system), cases) for point in points]
    return _not_dominated(optima)


def _spread(seen: Mapping[bytes, tuple[float, float]], n_points: int) -> list[Array]:
    """At most ``n_points`` non-dominated points, spread evenly over the length of the front."""
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
    return [np.frombuffer(front[index]) for index in chosen.tolist()]


def _minimum(
    objective: Callable[[Array], float],
    start: Sequence[Array],
    *,
    seed: int,
    generations: int,
) -> Array:
    """Best point of the unit box, (variable,), from a random population with given points."""
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    sampler = qmc.LatinHypercube(N_VARIABLES, rng=np.random.default_rng(seed))
    population = sampler.random(POPULATION * N_VARIABLES)
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
                tip_relief=depth * tip * (tip_height > 0.0),
                tip_relief_height=height * tip_height,
                root_relief=depth * root * (root_height > 0.0),
                root_relief_height=height * root_height,
            )
        )
    crowned = replace(sides[0], crowning=depth * float(point[8]))
    return PairModification(pinion=crowned, wheel=sides[1])


def _not_dominated(optima: Sequence[Optimum]) -> list[Optimum]:
    """The optima for which no other is as good in both values and better in one.

    By rising ripple, without duplicates.
    """
    by_values = {(optimum.ripple, optimum.line_load): optimum for optimum in optima}
    front: list[Optimum] = []
    for _, optimum in sorted(by_values.items(), key=lambda item: item[0]):
        if not front or optimum.line_load < front[-1].line_load:
            front.append(optimum)
    return front
