"""Import paths of version 0.9 that users have in their programs, and where the modules are now.

``import diagnose.metrics`` and ``from gensig.config import read_request`` keep working. The
finder is asked only for modules that do not exist, so that it costs nothing elsewhere.
"""

from __future__ import annotations

import importlib
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MOVED = {
    "gensig.compose": "gensig.options.compose",
    "gensig.config": "gensig.plan.request",
    "gensig.dynamics.forced": "gensig.driveline.linear.forced",
    "gensig.dynamics.newmark": "gensig.driveline.time.newmark",
    "gensig.life.root_stress": "gensig.life.root.root_stress",
    "gensig.pairs": "gensig.production.fault_pairs",
    "gensig.streaming": "gensig.production.streaming",
    "gensig.systems.mesh_phase": "gensig.driveline.mesh_phase",
    "gensig.systems.shaft_line": "gensig.driveline.drive_line",
    "diagnose.at_rate": "diagnose.data.at_rate",
    "diagnose.calibration": "diagnose.networks.calibration",
    "diagnose.features": "diagnose.baselines.features",
    "diagnose.metrics": "diagnose.scoring.metrics",
    "diagnose.model_io": "diagnose.training.store",
    "diagnose.models": "diagnose.networks.registry",
    "diagnose.protocols": "diagnose.data.protocols",
    "diagnose.train": "diagnose.training.classes",
    "diagnose.turns": "diagnose.data.turns",
    "diagnose.windows": "diagnose.data.windows",
}


class MovedFinder(MetaPathFinder, Loader):
    """Finds a module of ``MOVED`` under its former name.

    The same module object as under the new one.
    """

    def find_spec(
        self, fullname: str, path: Any = None, target: Any = None
    ) -> ModuleSpec | None:
        """The spec of a moved module; None for any other name."""
        return ModuleSpec(fullname, self) if fullname in MOVED else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """An empty module, which `exec_module` replaces."""
        return ModuleType(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Put the module's new home under its former name."""
        sys.modules[module.__name__] = importlib.import_module(MOVED[module.__name__])


def install() -> None:
    """Let former import paths work in this process."""
    if not any(isinstance(finder, MovedFinder) for finder in sys.meta_path):
        sys.meta_path.append(MovedFinder())
