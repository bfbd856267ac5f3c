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


@pytest.fixture(scope="session")
def known_machines():
    """Records at two conditions a unit, with sound ones at both."""
    dataset = two_channels(duration=0.3)
    row = np.arange(dataset.n_records)
    dataset.columns["condition_id"] = np.array([f"c{k:03d}" for k in row // 4])
    dataset.columns["speed_set_rpm"] = 1000.0 + row // 4
    dataset.columns["fault_gear"] = np.where(dataset.columns["label"] > 0, "pinion", "")
    return dataset


@pytest.fixture(scope="session")
def tooth_study(tmp_path_factory, known_machines):
    """Folder of a study of networks on teeth, without and with a sound record."""
    out = tmp_path_factory.mktemp("teeth") / "out"
    small = ("model=tooth", "model.samples_per_tooth=16", "model.widths=[8,4]")
    words = (*QUICK, *small, *NETWORK_ONLY, "reference=other_condition")
    return train(out, known_machines, *words, "epochs=1", "oracle=false")


@pytest.fixture
def recorded(tmp_path):
    """Function that writes signals as a file that a user has."""

    def write(signal, rate=12800, name="mine.npz"):
        np.savez(tmp_path / name, acceleration=signal, sampling_rate_hz=rate)
        return str(tmp_path / name)

    return write
