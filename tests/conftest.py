"""Shared fixtures: the paper's rig as a configuration and as a machine."""

import gc
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import kept_options
import pytest
from hypothesis import settings
from parts import Parts

import gensig.compilation
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import RunningPair
from gensig.geometry.contact import SIDES
from gensig.geometry.gear import Gear
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request
from gensig.systems.pair_machine import GearPairMachine, running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run

# An example that takes long on a busy machine is no failure.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# A cold cache of kernels adds no line to what a command prints; test_progress has a process for it.
gensig.compilation.on_compilation = lambda *told: nullcontext()

kept_options.keep()

# The first file compiles the integrator, which takes a minute; those of the networks, which
# another process begins with, need none of it and find everything compiled afterwards. Then
# what takes long, so that no process ends alone.
FIRST = (
    "tests/literature/test_validation_document.py",
    "tests/unit/diagnose/",
    "tests/pipeline/test_crash_safety.py",
    "tests/unit/dataset/test_fuzz.py",
    "tests/pipeline/",
    "tests/unit/dataset/",
)


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Parts())


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(
        key=lambda item: next(
            (k for k, name in enumerate(FIRST) if item.nodeid.startswith(name)),
            len(FIRST),
        )
    )
    # what was collected lives to the end: the collector of garbage need not look at it again
    gc.freeze()


@pytest.fixture(scope="session")
def composed_config() -> Configuration:
    """The default configuration, composed once."""
    return read_request([]).config


@pytest.fixture(scope="session")
def config_with(composed_config) -> Callable[..., Configuration]:
    """The default configuration with dotted keys replaced, without composing again."""

    def make(changes: Mapping[str, Any] | None = None) -> Configuration:
        config = composed_config.plain()
        for key, value in (changes or {}).items():
            *parents, leaf = key.split(".")
            node = config
            for name in parents:
                node = node[name]
            assert leaf in node, f"no key {key}"
            node[leaf] = value
        return Configuration(config)

    return make


@pytest.fixture(scope="session")
def machine(config_with) -> Callable[..., GearPairMachine]:
    """The xiamen pair with dotted keys replaced."""
    return lambda changes=None: read_system(config_with(changes))


@pytest.fixture(scope="session")
def xiamen(machine) -> GearPairMachine:
    return machine()


@pytest.fixture(scope="session")
def paper_machine(machine) -> GearPairMachine:
    """Every convention of the spur paper."""
    return machine(
        {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear"}
    )


@pytest.fixture(scope="session")
def gear_with(xiamen) -> Callable[..., Gear]:
    """The pinion with fields replaced; the bore follows the size."""

    def make(**changes: Any) -> Gear:
        radius = 0.5 * changes.get("n_teeth", 23) * changes.get("normal_module", 2e-3)
        return replace(xiamen.pair.pinion, **{"bore_radius": 0.35 * radius, **changes})

    return make


@pytest.fixture(scope="session")
def dynamics_of(running_of) -> Callable[..., Dynamics]:
    """A machine in motion, as ``running_of`` has it."""
    return lambda *given, **errors: running_of(*given, **errors).dynamics


@pytest.fixture(scope="session")
def running_of() -> Callable[..., RunningPair]:
    """A machine's pair with perfect teeth, or with the given tooth errors."""

    def make(
        system: GearPairMachine, faults=(), *, phase=0.3, **given: Any
    ) -> RunningPair:
        running = running_pair(Run(system=system, faults=tuple(faults)))
        teeth = replace(running.teeth, start_phase=phase)
        errors, tilts = (
            tuple(
                given.get(f"{gear}_{key}", zeros)
                for gear, zeros in zip(SIDES, teeth.errors, strict=True)
            )
            for key in ("error", "tilt")
        )
        return replace(running, teeth=replace(teeth, errors=errors, tilts=tilts))

    return make


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium; the tests that ask for it are skipped where there is none.

    Needs the package ``playwright`` and ``GENSIG_CHROMIUM=/path/to/chromium``, or a Chromium on
    the path, or the one that ``playwright install chromium`` fetches.
    """
    playwright = pytest.importorskip("playwright.sync_api", reason="package playwright")
    on_path = filter(None, map(shutil.which, ("chromium", "google-chrome")))
    path = os.environ.get("GENSIG_CHROMIUM") or next(on_path, None)
    words = ["--no-sandbox", "--disable-gpu"]
    with playwright.sync_playwright() as started:
        try:
            browser = started.chromium.launch(executable_path=path, args=words)
        except playwright.Error as error:
            pytest.skip(f"no Chromium: {str(error).splitlines()[0]}")
        yield browser
        browser.close()
