"""A second backend next to the compiled core: LSODA of scipy, by ``solver.backend`` alone."""

from dataclasses import replace

import numpy as np
import pytest
from plain_motion import at_rest, equations, solved
from refusals import refused

from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.registry import BACKENDS, EXPLICIT_BACKEND
from gensig.dynamics.decimation import decimator, in_band_error
from gensig.dynamics.integrator import (
    Solver,
    check_machine,
    records_together,
)
from gensig.errors import ConfigError, SimulationError
from gensig.systems.base import simulate_together
from gensig.systems.run import Run, Start
from gensig.units import read

ACCURACY = (
    1e-3  # of a channel's spectrum: accuracy of the compiled core at its default step
)
QUICK = {
    "operating.duration_s": 0.03,
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
MORE_DAMPED = {"mesh.damping_ratio": 0.0735}  # by a twentieth
LEAST_RATE = 1e4  # Hz, lowest sampling rate of the backend below


class Lsoda(Backend):
    """Adaptive multistep method of scipy on the plain equations, for steady spur pairs."""

    def check_step(self, machine, sampling_rate, oversampling) -> None:
        if sampling_rate < LEAST_RATE:
            raise SimulationError(f"lsoda: {sampling_rate:g} Hz is too slow")

    def records_together(self, precision: str) -> int:
        return 1

    def integrate(self, machines, integration: Integration) -> Motions:
        motions = [motion(machine, integration) for machine in machines]
        acceleration, angle = (np.array(part) for part in zip(*motions, strict=True))
        n = len(machines)
        return Motions(
            acceleration=acceleration,
            check=acceleration,
            angle=angle[:, None, :-1],
            seen=np.empty((n, 0, integration.n_samples)),
            mean_speed=(angle[:, -1] - angle[:, 0]) / integration.duration,
            contact_loss=np.zeros((n, 1)),
            finite=np.isfinite(acceleration).all(axis=(1, 2)),
        )


def motion(machine, integration):
    """Accelerations (channel, sample), and angles of the pinion (sample + 1,), from rest."""
    low_pass = decimator(integration.oversampling)
    rate = integration.sampling_rate
    factor = low_pass.oversampling
    margin = low_pass.margin
    first = -margin * factor - 1
    last = (integration.n_samples + margin) * factor
    times = np.arange(first, last + 1) / (rate * factor)
    begin = times[0] - machine.settling_time
    slope = equations(machine)[0]
    start = at_rest(machine, begin)
    states = solved(slope, start, np.append(begin, times), "LSODA", 1e-7)[1:]
    dofs = [machine.dofs.index(name) + 6 for name in integration.channels]
    means = np.diff(states[:, dofs], axis=0) * rate * factor
    angle = machine.nominal.at(0.0).speed * times + states[:, 2]
    recorded = angle[margin * factor + 1 :: factor][: integration.n_samples + 1]
    return low_pass.apply_to_columns(means).T, recorded


@pytest.fixture
def lsoda(monkeypatch) -> str:
    """The name of a second backend, for one test the only other; benchmarks have theirs."""
    for name in [name for name in BACKENDS if name != "nystroem"]:
        monkeypatch.delitem(BACKENDS, name)
    monkeypatch.setitem(BACKENDS, "lsoda", Lsoda())
    return "lsoda"


@pytest.fixture
def record(machine):
    """A record by a backend."""

    def simulated(backend, **changes):
        system = machine({**QUICK, **changes})
        system = replace(
            system,
            solver=replace(system.solver, backend=backend),
        )
        return simulate_together(
            [
                Run(
                    system=system,
                    start=Start(phase=0.3),
                )
            ]
        )[0]

    return simulated


def test_both_backends_agree(record, lsoda):
    """As far as the compiled core is accurate; another machine would show."""
    core = record(EXPLICIT_BACKEND)
    other = record(lsoda)
    damped = record(EXPLICIT_BACKEND, **MORE_DAMPED)
    exact = other.acceleration[None]
    error, shown = (
        in_band_error(each.acceleration[None], exact, 51200.0)[0]
        for each in (core, damped)
    )

    assert 0.0 < error < ACCURACY < 0.2 * shown
    assert np.abs(core.shaft_angle - other.shaft_angle).max() < 1e-6
    assert abs(core.mean_speed - other.mean_speed) < 1e-5 * core.mean_speed
    assert other.integration_check == "error"


def test_limits_are_those_of_the_backend(machine, dynamics_of, record, lsoda):
    dynamics = dynamics_of(machine())
    core = Solver(oversampling=2, precision="float64")
    other = replace(core, backend=lsoda)

    with refused("makes internal steps of", SimulationError):
        check_machine(dynamics, core, 1e4)

    check_machine(dynamics, other, 1e4)
    with refused("lsoda: 100 Hz is too slow", SimulationError):
        check_machine(dynamics, other, 100.0)

    solvers = core, replace(core, precision="float32"), other
    assert [records_together(solver) for solver in solvers] == [
        8,
        16,
        1,
    ]

    failed = record(lsoda, **{"sensing.sampling_rate_hz": 8000})
    assert str(failed) == "lsoda: 8000 Hz is too slow"


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("euler", "solver.backend = 'euler'; allowed: nystroem, lsoda, newmark"),
        (
            "runge_kutta",
            "solver.backend = runge_kutta, the method of data sets that name none, left with "
            "version 0.19; take solver.backend=nystroem",
        ),
    ],
)
def test_an_unknown_backend_is_refused(config_with, lsoda, name, line):
    options = config_with().section("solver").plain()
    assert read(Solver, options, "solver").backend == "nystroem"
    with pytest.raises(ConfigError) as caught:
        read(Solver, options | {"backend": name}, "solver")
    assert str(caught.value) == line
