"""A second backend beside the compiled core: scipy's LSODA, chosen by ``solver.backend`` alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from plain_motion import at_rest, equations, solved

from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.registry import BACKENDS, DEFAULT_BACKEND
from gensig.dynamics.decimation import decimator, in_band_error
from gensig.dynamics.integrator import (
    Solver,
    check_machine,
    records_together,
    settling_time,
)
from gensig.dynamics.pair import PairDynamics
from gensig.errors import ConfigError, SimulationError
from gensig.systems.base import simulate_together
from gensig.systems.run import CleanRecord, Run, Start
from gensig.units import read

ACCURACY = (
    1e-3  # of a channel's spectrum: what the compiled core promises at its default step
)
QUICK = {
    "operating.duration_s": 0.03,
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
MORE_DAMPED = {"mesh.damping_ratio": 0.0735}  # by a twentieth
TOO_SLOW_TO_FOLLOW = 1e4  # Hz, lowest sampling rate that the backend below takes


class Lsoda(Backend):
    """Adaptive multistep method of scipy on the plain equations, one steady spur pair after the other."""

    def check_step(self, machine, sampling_rate, oversampling, max_error) -> None:
        if sampling_rate < TOO_SLOW_TO_FOLLOW:
            raise SimulationError(f"lsoda: {sampling_rate:g} Hz is too slow")

    def records_together(self, precision: str) -> int:
        return 1

    def integrate(
        self, machines: Sequence[PairDynamics], integration: Integration
    ) -> Motions:
        rows = [motion(machine, integration) for machine in machines]
        acceleration, angle = (np.array(part) for part in zip(*rows, strict=True))
        n = len(machines)
        speed = (angle[:, -1] - angle[:, 0]) / integration.duration
        return Motions(
            acceleration=acceleration,
            check=acceleration,
            shaft_angle=angle[:, :-1],
            seen=np.empty((n, 0, integration.n_samples)),
            mean_speed=speed,
            contact_loss_fraction=np.zeros(n),
            finite=np.isfinite(acceleration).all(axis=(1, 2)),
        )


def motion(
    machine: PairDynamics, integration: Integration
) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (channel, sample), and angles of the pinion (sample + 1,), of one machine from rest."""
    low_pass, rate = decimator(integration.oversampling), integration.sampling_rate
    factor, margin = low_pass.oversampling, low_pass.margin
    first, last = -margin * factor - 1, (integration.n_samples + margin) * factor
    times = np.arange(first, last + 1) / (rate * factor)
    begin = times[0] - settling_time(machine)
    slope, _ = equations(machine)
    states = solved(
        slope, at_rest(machine, begin), np.append(begin, times), "LSODA", 1e-7
    )[1:]
    dofs = [machine.dofs.index(name) for name in integration.channels]
    means = np.diff(states[:, 6:][:, dofs], axis=0) * rate * factor
    angle = machine.operating.speed * times + states[:, 2]
    recorded = angle[margin * factor + 1 :: factor][: integration.n_samples + 1]
    return low_pass.apply_to_columns(means).T, recorded


@pytest.fixture
def lsoda(monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of a second backend, registered for one test."""
    monkeypatch.setitem(BACKENDS, "lsoda", Lsoda())
    return "lsoda"


@pytest.fixture
def record(machine):
    """A record by a backend."""

    def simulated(backend: str, **changes: object) -> CleanRecord | SimulationError:
        system = machine({**QUICK, **changes})
        system = replace(system, solver=replace(system.solver, backend=backend))
        start = Start(tooth_pinion=0, tooth_wheel=0, phase=0.3)
        return simulate_together([Run(system=system, faults=(), start=start)])[0]

    return simulated


def test_a_record_by_another_backend(record, lsoda: str) -> None:
    """The two methods agree as far as the compiled core promises; another machine would show."""
    core, other = record(DEFAULT_BACKEND), record(lsoda)
    damped = record(DEFAULT_BACKEND, **MORE_DAMPED)
    error, shown = (
        in_band_error(found.acceleration[None], other.acceleration[None], 51200.0)[0]
        for found in (core, damped)
    )
    assert 0.0 < error < ACCURACY
    assert shown > 5 * ACCURACY
    assert np.abs(core.shaft_angle - other.shaft_angle).max() < 1e-6
    assert abs(core.mean_speed - other.mean_speed) < 1e-5 * core.mean_speed
    assert other.integration_check == "error"


def test_backends_are_asked_what_they_can(machine, dynamics_of, lsoda: str) -> None:
    """Limits of the step, and records worth simulating together, are those of the backend."""
    system = machine()
    dynamics, core = dynamics_of(system), Solver(oversampling=2, precision="float64")
    other = replace(core, backend=lsoda)
    with pytest.raises(SimulationError, match="makes internal steps of"):
        check_machine(dynamics, core, 1e4)
    check_machine(dynamics, other, 1e4)
    with pytest.raises(SimulationError, match="lsoda: 100 Hz is too slow"):
        check_machine(dynamics, other, 100.0)
    assert [
        records_together(solver)
        for solver in (core, replace(core, precision="float32"), other)
    ] == [8, 16, 1]


def test_a_machine_that_a_backend_refuses_is_a_failed_record(
    record, lsoda: str
) -> None:
    failed = record(lsoda, **{"sensing.sampling_rate_hz": 8000})
    assert isinstance(failed, SimulationError)
    assert str(failed) == "lsoda: 8000 Hz is too slow"


def test_an_unknown_backend_is_refused_with_those_that_there_are(
    config_with, lsoda: str
) -> None:
    options = config_with().section("solver").plain()
    assert read(Solver, options, "solver").backend == DEFAULT_BACKEND == "runge_kutta"
    with pytest.raises(ConfigError) as caught:
        read(Solver, options | {"backend": "euler"}, "solver")
    assert str(caught.value) == "solver.backend = 'euler'; allowed: runge_kutta, lsoda"


def test_a_configuration_without_the_key_means_the_default(config_with) -> None:
    """Data sets of 0.9.0 know no backend."""
    options = config_with().section("solver").without("backend")
    assert "backend" not in options
    assert options.read(Solver).backend == DEFAULT_BACKEND
