import pytest
from implant_samples import carrier, write_pairs


@pytest.fixture(scope="session")
def pairs_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs") / "set"
    write_pairs(folder).close()
    return folder


@pytest.fixture
def pairs(pairs_folder):
    from gensig.dataset.reader import open_dataset

    with open_dataset(pairs_folder) as data:
        yield data


@pytest.fixture(scope="session")
def healthy():
    """Two recordings of the machine."""
    return [carrier(seed)[0] for seed in range(2)]
