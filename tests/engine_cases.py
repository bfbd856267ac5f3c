"""The engine of the paper: its shaft line as plain arrays, its excitation as configured, other
firing orders.
"""

import copy
import csv
from functools import lru_cache
from pathlib import Path

import numpy as np
import yaml

from gensig.driveline.excitation.engine import read_engine
from gensig.driveline.excitation.engine_torques import engine_torques
from gensig.driveline.linear.forced import Elements, steady_response
from gensig.dynamics.linear_system import LinearSystem

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
TABLE = CONFIGS / "tables" / "engine_shafting.csv"
OPTION = CONFIGS / "excitation" / "engine_v20.yaml"
LOSS = {"shaft": 0.03, "rigid": 0.0, "coupling": 0.15, "gear_mesh": 0.08}
DAMPER_STATES = {
    "as_printed": 1.0,
    "half_ring": 0.5,
    "detached": 1e-6,
}  # of the damper's outer inertia
RPM = np.pi / 30.0
SPEED, TORQUE = 1688 * RPM, 12680.0
SLOTS_OF_BANK_A = (
    0,
    1,
    4,
    5,
    8,
    9,
    12,
    13,
    16,
    17,
)  # of 20, 36 degrees each; bank B fires two slots later
IN_SEQUENCE = tuple(range(1, 11))


def option(**changes):
    values = yaml.safe_load(OPTION.read_text(encoding="utf-8"))
    values.update(changes)
    return values


@lru_cache(maxsize=1)
def rows():
    with TABLE.open(encoding="utf-8") as stream:
        return tuple(
            csv.DictReader(line for line in stream if not line.startswith("#"))
        )


def ratios():
    return {int(row["node"]): float(row["speed_ratio"]) for row in rows()}


def ratio_of_teeth():
    """Exact ratios: those printed in the table have six digits."""
    result = {1: 1.0}
    for row in rows():
        if row["edge_from"]:
            first, second = int(row["edge_from"]), int(row["edge_to"])
            teeth = int(row["teeth_from"] or 1) / int(row["teeth_to"] or 1)
            result[second] = result[first] * teeth
    return {node: result[node] for node in ratios()}


@lru_cache(maxsize=8)
def engine_line(damper="as_printed"):
    """The line (67 torsional degrees of freedom) and its 66 joints, with ``ends`` as (from, to)
    node numbers.
    """
    ratio, joints = ratio_of_teeth(), [row for row in rows() if row["edge_from"]]
    inertia = np.array([float(row["inertia_kg_m2"]) for row in rows()])
    inertia[0] *= DAMPER_STATES[damper]
    directions = np.zeros((len(joints), len(inertia)))
    ends = []
    for direction, row in zip(directions, joints, strict=True):
        first, second = int(row["edge_from"]), int(row["edge_to"])
        step = ratio[second] / ratio[first]  # a mesh row is k times both base radii
        direction[first - 1], direction[second - 1] = step**0.5, -(step**-0.5)
        ends.append((first, second))
    stiffness = np.array([1e6 * float(row["stiffness_mnm_per_rad"]) for row in joints])
    loss = np.array([LOSS[row["edge_kind"]] for row in joints])
    elements = Elements(
        directions=directions, stiffness=stiffness, loss=loss * stiffness
    )
    line = LinearSystem(
        mass=np.diag(inertia),
        stiffness=elements.stiffness_matrix(),
        loss=elements.loss_matrix(),
        damping=np.zeros((len(inertia), len(inertia))),
    )
    return line, elements, tuple(ends)


def with_throws(values, throws_of_bank_a):
    """The engine with the throws of bank A firing in another order, bank B 72 degrees later."""
    values = copy.deepcopy(values)
    slot = dict(zip(throws_of_bank_a, SLOTS_OF_BANK_A, strict=True))
    fires = {slot[throw]: f"A{throw}" for throw in slot} | {
        (slot[throw] + 2) % 20: f"B{throw}" for throw in slot
    }
    values["layout"]["throw_angles_deg"] = [
        36 * slot[throw] % 360 for throw in sorted(slot)
    ]
    values["layout"]["firing_order"] = [fires[place] for place in range(20)]
    return values


def torques_of(values, speed=SPEED, torque=TORQUE):
    return engine_torques(read_engine(values), speed, torque, ratio_of_teeth())


def response_of(values, damper="as_printed", speed=SPEED, torque=TORQUE):
    """Steady vibration of the whole line; fluctuation in rad/s by node number through ``node -
    1``.
    """
    line, _, _ = engine_line(damper)
    return steady_response(
        line, torques_of(values, speed, torque).on(tuple(ratios())), speed
    )
