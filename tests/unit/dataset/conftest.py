import functools
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from dataset_samples import build, make_plan

from gensig.dataset.folder import beginning
from gensig.dataset.plan import Plan


@pytest.fixture(scope="session", autouse=True)
def environment() -> Iterator[None]:
    """The environment of the run, found once: it takes longer than a small data set."""
    with pytest.MonkeyPatch.context() as patch:
        cached = functools.cache(beginning.environment)
        patch.setattr(beginning, "environment", cached)
        yield


@pytest.fixture
def plan() -> Plan:
    return make_plan()


@pytest.fixture(scope="session")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A closed data set, to read only."""
    return build(tmp_path_factory.mktemp("template") / "set", make_plan())


@pytest.fixture
def folder(tmp_path: Path, template: Path) -> Path:
    """A copy of the closed data set, to damage."""
    return shutil.copytree(template, tmp_path / "set")
