"""Shared fixtures: the paper's rig as a configuration and as a machine."""

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gensig.config import read_request
from gensig.dynamics.pair import PairDynamics
from gensig.geometry.gear import Gear
from gensig.systems.registry import read_system
from gensig.systems.spur_pair import SpurPair


@pytest.fixture(scope="session")
def composed_config() -> dict[str, Any]:
    """The default configuration, composed once; copy before changing."""
    return read_request([]).config


@pytest.fixture(scope="session")
def config_with(composed_config) -> Callable[..., dict[str, Any]]:
    """A plain configuration with dotted keys replaced, without composing again."""

    def make(changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        config = copy.deepcopy(composed_config)
        for key, value in (changes or {}).items():
            *parents, leaf = key.split(".")
            node = config
            for name in parents:
                node = node[name]
            assert leaf in node, f"no key {key}"
            node[leaf] = value
        return config

    return make


@pytest.fixture(scope="session")
def machine(config_with) -> Callable[..., SpurPair]:
    """The xiamen pair with dotted keys replaced."""
    return lambda changes=None: read_system(config_with(changes))


@pytest.fixture(scope="session")
def xiamen(machine) -> SpurPair:
    return machine()


@pytest.fixture(scope="session")
def paper_machine(machine) -> SpurPair:
    """Every convention of the spur paper."""
    return machine({"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear"})


@pytest.fixture(scope="session")
def gear_with(xiamen) -> Callable[..., Gear]:
    """The pinion with fields replaced; the bore follows the size."""

    def make(**changes: Any) -> Gear:
        radius = 0.5 * changes.get("n_teeth", 23) * changes.get("normal_module", 2e-3)
        return replace(xiamen.pair.pinion, **{"bore_radius": 0.35 * radius, **changes})

    return make


@pytest.fixture(scope="session")
def dynamics_of() -> Callable[..., PairDynamics]:
    """Equations of motion of a machine with perfect teeth, or with the given tooth errors."""

    def make(system: SpurPair, faults=(), *, phase=0.3, **errors: Any) -> PairDynamics:
        counts = {"pinion": system.pair.pinion.n_teeth, "wheel": system.pair.wheel.n_teeth}
        perfect = {f"{gear}_{key}": np.zeros(n) for gear, n in counts.items() for key in ("error", "tilt")}
        return PairDynamics(
            table=system.mesh_table(faults),
            pinion=system.pinion,
            wheel=system.wheel,
            motor=system.motor,
            load=system.load,
            operating=system.operating,
            **{**perfect, **errors},
            start_tooth_pinion=0,
            start_tooth_wheel=0,
            start_phase=phase,
        )

    return make
