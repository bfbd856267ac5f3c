"""The group ``sensing`` of shipped options, keys changed, and the instruments it describes."""

import copy

from numpy.random import default_rng

from gensig.plan.request import read_request
from gensig.sensing.instrument import draw_instrument
from gensig.sensing.options import read_sensing

BEARING, HOUSING, MACHINE = (
    read_request([f"sensing={name}"]).config["sensing"]
    for name in ("bearing", "housing", "machine")
)


def changed(group, changes):
    """A group with values replaced; keys are dotted, numbers are places in a list."""
    group = copy.deepcopy(dict(group))
    for key, value in changes.items():
        *parents, leaf = key.split(".")
        node = group
        for parent in parents:
            node = node[int(parent) if parent.isdigit() else parent]
        node[leaf] = value
    return group


def instrument(group, seed=0):
    streams = [default_rng(seed + k) for k in range(2)]
    return draw_instrument(read_sensing(group), *streams)


def source(sensing, n_samples=51_200):
    rng = default_rng(9)
    return rng.standard_normal((len(sensing.channels), sensing.n_lead + n_samples))
