"""Stiffness of single pairs and of the mesh, by the names that the rows use."""

from __future__ import annotations

import numpy as np

from gensig.faults.base import faulty_teeth
from gensig.mesh.load_distribution import StaticMesh, pair_states, static_mesh
from gensig.mesh.local_contact import contact_law
from validation.case import Array, Case, with_words
from validation.checks.geometry_checks import Check
from validation.pair_compliances import pair_compliance

N_MEAN = 4000  # points of a mean over a zone


def contact_compliance(case: Case, position: Array) -> Array:
    """Local compliance of both flanks of a pair that carries the whole load, (phase,) m/N."""
    law = contact_law(case.pair, position, case.system.material, case.system.mesh)
    return np.asarray(
        law.compliance(case.pair.pinion.face_width, case.system.mesh_force)
    )


def _contact(case: Case, at: str) -> float:
    return float(contact_compliance(case, np.array([case.position(at)]))[0])


def _pair_stiffness(case: Case, position: Array) -> Array:
    if not all(
        tooth.present for tooth in faulty_teeth(case.pair, case.faults).values()
    ):
        return np.zeros_like(position)
    return 1.0 / pair_compliance(case.whole_load_table, position, **case.faulty_kinds)


def single_pair_stiffness(case: Case, at: str) -> float:
    """Stiffness of one pair under the whole load, faulty where the case has a fault, at a named
    point, N/m.
    """
    return float(_pair_stiffness(case, np.array([case.position(at)]))[0])


def _zone(case: Case, name: str) -> tuple[float, float]:
    """First and last roll of a zone of the mesh cycle, m."""
    pitch = case.pair.base_pitch
    double = case.pair.path_of_contact - pitch
    zones = {"cycle": (0.0, pitch), "single": (double, pitch), "double": (0.0, double)}
    return zones[name]


def _mean_stiffness(case: Case, at: str) -> float:
    """Mean over a cycle, the single or the double zone, of a train of pairs that are all alike
    and add up.
    """
    pair = case.pair
    share = (np.arange(N_MEAN) + 0.5) / N_MEAN
    if at == "cycle":
        path = pair.path_of_contact
        return (
            float(_pair_stiffness(case, share * path).mean()) * path / pair.base_pitch
        )
    first, last = _zone(case, at)
    entering = _pair_stiffness(case, first + share * (last - first))
    if at == "single":
        return float(entering.mean())
    return float(
        (entering + _pair_stiffness(case, share * last + pair.base_pitch)).mean()
    )


def statics(case: Case, roll: Array) -> StaticMesh:
    """Equilibrium under the set torque; teeth 0 enter at A at roll 0."""
    return static_mesh(
        case.table, pair_states(case.table, roll), case.system.mesh_force
    )


def mesh_stiffness(case: Case, roll: Array) -> Array:
    """Tangent stiffness of all pairs under the set torque, (phase,) N/m."""
    return statics(case, roll).stiffness


def _mesh_stiffness_at(case: Case, at: str) -> float:
    """At a roll in base pitches from the entry of a pair at A."""
    return float(mesh_stiffness(case, np.array([float(at) * case.pair.base_pitch]))[0])


def mean_mesh_stiffness(case: Case, at: str) -> float:
    """Mean tangent stiffness over a cycle, the single or the double zone."""
    first, last = _zone(case, at)
    roll = first + (last - first) * (np.arange(N_MEAN) + 0.5) / N_MEAN
    return float(mesh_stiffness(case, roll).mean())


def _double_roll(case: Case, at: str) -> Array:
    """Roll at a share of the double zone, its ends taken just inside."""
    return np.array([np.clip(float(at), 1e-9, 1.0 - 1e-9) * _zone(case, "double")[1]])


def _double_zone_stiffness(case: Case, at: str) -> float:
    """At a share of the double zone, or its largest value."""
    if at == "max":
        roll = np.linspace(0.001, 0.999, 999) * _zone(case, "double")[1]
        return float(mesh_stiffness(case, roll).max())
    return float(mesh_stiffness(case, _double_roll(case, at))[0])


def _load_share(case: Case, at: str) -> float:
    """Share of the load that the entering pair has at a share of the double zone."""
    load = statics(case, _double_roll(case, at)).load[0]
    return float(load[1] / load.sum())  # the first is still before A


def _coupled_over_sum(case: Case, at: str) -> float:
    """Stiffness amid the double zone over the largest of the plain sum."""
    total = with_words(case, "mesh.pair_coupling=sum")
    return _double_zone_stiffness(case, "0.5") / _double_zone_stiffness(total, "max")


def _sum_over_coupled(case: Case, at: str) -> float:
    """Excess of the plain sum on the mean of the double zone."""
    total = with_words(case, "mesh.pair_coupling=sum")
    return (
        mean_mesh_stiffness(total, "double") / mean_mesh_stiffness(case, "double") - 1.0
    )


def _stiffness_harmonic(case: Case, at: str) -> float:
    """Amplitude of a mesh harmonic of the stiffness over its mean."""
    stiffness = mesh_stiffness(
        case, case.pair.base_pitch * (np.arange(8192) + 0.5) / 8192
    )
    spectrum = np.abs(np.fft.rfft(stiffness))
    return float(2.0 * spectrum[int(at)] / spectrum[0])


def largest_pair_stiffness(case: Case) -> float:
    """Largest stiffness of a single pair along the path, N/m.

    What standards call the single stiffness.
    """
    return float(
        _pair_stiffness(case, np.linspace(0.0, case.pair.path_of_contact, 501)).max()
    )


MESH: dict[str, Check] = {
    "contact": _contact,
    "contact_stiffness": lambda case, at: 1.0 / _contact(case, at),
    "single_pair_stiffness": single_pair_stiffness,
    "largest_pair_stiffness": lambda case, at: largest_pair_stiffness(case),
    "mean_stiffness": _mean_stiffness,
    "mesh_stiffness": _mesh_stiffness_at,
    "mean_mesh_stiffness": mean_mesh_stiffness,
    "double_over_single": lambda case, at: (
        mean_mesh_stiffness(case, "double") / _mean_stiffness(case, "single")
    ),
    "double_zone_stiffness": _double_zone_stiffness,
    "load_share": _load_share,
    "coupled_over_sum": _coupled_over_sum,
    "sum_over_coupled": _sum_over_coupled,
    "stiffness_harmonic": _stiffness_harmonic,
}
