import functools
import shutil

import pytest
from dataset_samples import build, make_plan

from gensig.dataset.folder import beginning
from gensig.dataset.reader import open_dataset


@pytest.fixture(scope="session", autouse=True)
def environment():
    """The environment of the run, found once: it takes longer than a small data set."""
    with pytest.MonkeyPatch.context() as patch:
        cached = functools.cache(beginning.environment)
        patch.setattr(beginning, "environment", cached)
        yield


@pytest.fixture
def plan():
    return make_plan()


@pytest.fixture(scope="session")
def template(tmp_path_factory):
    """A closed data set, to read only."""
    return build(tmp_path_factory.mktemp("template") / "set", make_plan())


@pytest.fixture
def folder(tmp_path, template):
    """A copy of the closed data set, to damage."""
    return shutil.copytree(template, tmp_path / "set")


@pytest.fixture
def data(template):
    """A reader of the closed data set."""
    with open_dataset(template) as result:
        yield result
