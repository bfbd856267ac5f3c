"""A workshop for each test, which shares with the others of its process what it makes."""

import pytest
from page_commands import SLURM
from workshop import Workshop


@pytest.fixture(scope="session")
def known():
    return {}


@pytest.fixture
def workshop(tmp_path, monkeypatch, known):
    monkeypatch.chdir(tmp_path)
    for name, value in SLURM.items():
        monkeypatch.setenv(f"SLURM_{name}", value)
    return Workshop(known=known)
