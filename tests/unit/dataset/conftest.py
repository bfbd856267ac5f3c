import shutil
from pathlib import Path

import pytest
from dataset_samples import build, make_plan

from gensig.dataset.plan import Plan


@pytest.fixture
def plan() -> Plan:
    return make_plan()


@pytest.fixture(scope="session")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("template") / "set", make_plan())


@pytest.fixture
def folder(tmp_path: Path, template: Path) -> Path:
    """A data set of the test's own, to read or to damage."""
    return shutil.copytree(template, tmp_path / "set")
