"""The small set of pairs that the tests of implants use, for the bridge."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "implants"))


@pytest.fixture(scope="session")
def pairs_folder(tmp_path_factory):
    from implant_samples import write_pairs

    folder = tmp_path_factory.mktemp("pairs") / "set"
    write_pairs(folder).close()
    return folder
