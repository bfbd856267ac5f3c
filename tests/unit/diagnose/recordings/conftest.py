"""Networks that tests of recordings share."""

import numpy as np
import pytest
from fake_lives import FakeLives
from runs import LIFE, NETWORK_ONLY, QUICK, SMALL_CNN, model_of, train
from small_studies import two_channels


@pytest.fixture(scope="session", name="two_channels")
def learnt_from():
    """Data set that the networks learnt from."""
    return two_channels()


@pytest.fixture(scope="session")
def train_network(tmp_path_factory):
    """Function that trains a network of the data set and returns its folder."""

    def make(*words, network=SMALL_CNN):
        out = tmp_path_factory.mktemp("study") / "out"
        words = (*QUICK, *network, *NETWORK_ONLY, *words)
        return model_of(train(out, two_channels(), *words))

    return make


@pytest.fixture(scope="session")
def model(two_channel_model):
    return two_channel_model


@pytest.fixture(scope="session")
def levels_model(train_network):
    """A network that sees levels in m/s2."""
    return train_network("epochs=2", "normalise=none")


@pytest.fixture(scope="session")
def lives():
    """Data set of lives."""
    return FakeLives(n_lives=24, n_censored=6, seed=1)


@pytest.fixture(scope="session")
def life_study(tmp_path_factory, lives):
    """Folder of a study of remaining lives."""
    out = tmp_path_factory.mktemp("lives") / "out"
    return train(out, lives, *LIFE, "normalise=none")


@pytest.fixture
def recorded(tmp_path):
    """Function that writes signals as a file that a user has."""

    def write(signal, rate=12800, name="mine.npz"):
        np.savez(tmp_path / name, acceleration=signal, sampling_rate_hz=rate)
        return str(tmp_path / name)

    return write
