"""Fixtures of the tests of `diagnose`; its subfolders can import the modules of this folder."""

import pytest
import torch
from small_studies import NETWORK_ALONE, train, two_channels
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Small work, for which threads cost more than they gain."""
    torch.set_num_threads(1)
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def two_channel_model(tmp_path_factory):
    """Folder of a network that the command trained on two channels."""
    out = tmp_path_factory.mktemp("study") / "out"
    train(two_channels(), out, "epochs=5", *NETWORK_ALONE)
    return str(out / "models" / "by_unit-seed0")


@pytest.fixture(scope="module")
def parts_of(source):
    """Function that returns the tables that a baseline reads, made once of a module's source."""
    made = {}

    def parts(baseline):
        if baseline.reads not in made:
            made[baseline.reads] = baseline.reads.make(source)
        return made[baseline.reads]

    return parts
