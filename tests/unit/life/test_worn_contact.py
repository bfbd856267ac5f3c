"""Loads along the path of contact: read between the two positions that bracket a node."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.life.wear.worn_contact import path_loads
from gensig.options.compose import compose
from gensig.systems.wear import read_wear_case

SPUR = ("gear=harbin_38_55", "gear.addendum_coefficient=1", "wear.threshold_um=30")
HELICAL = ("system=helical_pair", "wear.threshold_um=10", "mesh.n_slices=5")


@pytest.fixture(scope="module", params=[SPUR, HELICAL], ids=["spur", "helical"])
def case(request):
    return read_wear_case(compose("generate", list(request.param)))


def test_a_node_lies_between_neighbouring_positions_of_its_own_slice(case):
    loads, nodes = path_loads(case.mesh, case.path), case.path.position
    position = loads.contact.phases.position
    flat = position.ravel()
    for index in range(position.shape[-1]):
        low, high = flat[loads.before[index]], flat[loads.after[index]]
        own = np.sort(position[..., index].ravel())
        step = np.searchsorted(own, high) - np.searchsorted(own, low)
        assert np.all(step == 1)
        share = loads.share[index]
        inside = (nodes >= own[0]) & (nodes <= own[-1])
        assert inside.mean() > 0.9
        read = (1.0 - share) * low + share * high
        scale = np.ptp(nodes)
        assert_allclose(read[inside], nodes[inside], atol=1e-9 * scale)


def test_the_read_load_is_that_of_the_settled_contact(case):
    loads = path_loads(case.mesh, case.path)
    new = np.zeros((2, *loads.share.shape))
    settled = loads.contact.settled(new, 1000.0).line_load.ravel()
    read = loads.line_load(new, 1000.0)
    low, high = settled[loads.before], settled[loads.after]
    assert np.all(read >= np.minimum(low, high) - 1e-9 * settled.max())
    assert np.all(read <= np.maximum(low, high) + 1e-9 * settled.max())
    assert read.max() > 0.0
