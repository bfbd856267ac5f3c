"""A helix of 0.01 degrees is the spur pair at rest; in motion it is as stiff as the tangent."""

import numpy as np
import pytest

from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.plan.request import read_request
from gensig.record.machines import read_machine

PAIR = ("gear=xiamen_23_84", "gear.helix_angle_deg=0.01")


def at_rest(*words, torque=20.0):
    """Approach m and table's tangent stiffness N/m over a mesh period, and the force N."""
    config = read_request([*words, f"operating.torque_nm={torque}"]).config
    machine = read_machine(config)
    table, force = machine.mesh_table(), machine.mesh_force
    roll = table.pair.base_pitch * (np.arange(64) + 0.5) / 64
    result = static_mesh(table, pair_states(table, roll), force)
    return result.approach, result.stiffness, force


@pytest.mark.parametrize(
    ("contact", "low", "high"), [("weber", 0.02, 0.03), ("linear", -0.002, 0.002)]
)
def test_a_small_helix_differs_by_the_secant_of_the_contact(contact, low, high):
    law = f"mesh.contact={contact}"
    spur, soft, force = at_rest("system=spur_pair", law)
    helix, stiff, _ = at_rest("system=helical_pair", *PAIR, law)
    assert abs(np.mean(force / helix) / np.mean(force / spur) - 1.0) < 1e-3
    assert low < stiff.mean() / soft.mean() - 1.0 < high


def test_the_tangent_of_the_spur_pair_is_the_helix_within_half_a_per_cent():
    below, above = (at_rest("system=spur_pair", torque=t) for t in (19.8, 20.2))
    tangent = np.mean((above[2] - below[2]) / (above[0] - below[0]))
    stiff = at_rest("system=helical_pair", *PAIR)[1].mean()
    assert abs(stiff / tangent - 1.0) < 0.006
