"""Simulations that fail."""

import pytest

from gensig.errors import SimulationError
from gensig.record import inputs


@pytest.fixture
def last_fails(monkeypatch):
    """The last motion of every simulation grows without bound."""
    whole = inputs.simulate_with_lead_in

    def failing(runs):
        return [*whole(runs)[:-1], SimulationError("the motion grew without bound")]

    monkeypatch.setattr(inputs, "simulate_with_lead_in", failing)
