"""Lines for the two-evaluation core: a pair as a line, runs of line machines and their records."""

from dataclasses import replace

import numpy as np
from stacked_motions import integrate

from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import PINION_ROTATION
from gensig.sensing.manufacturing import draw_specimen
from gensig.systems.base import further_gears, simulate_together
from gensig.systems.run import CleanRecord, Run, Start

RATE = 51200.0
# of the motions in the plane in a pair as a line, whose core does not know them
WHEEL_FIRST = (3, 4, 5, 0, 1, 2)
CHANNELS = ("pinion_x", "pinion_y", "wheel_x", "wheel_y", "wheel_rotation")


def as_line(pair):
    """A gear pair without rotors as a line of one mesh, whose bodies stand in another order."""
    system = pair.system
    order = np.array([*WHEEL_FIRST, *range(6, len(pair.dofs))])
    places = np.argsort(order)
    pinion = int(places[PINION_ROTATION])
    both = np.ix_(order, order)
    (mesh,) = system.meshes
    torques = [replace(each, dof=int(places[each.dof])) for each in pair.torques]
    return replace(
        pair,
        dofs=tuple(pair.dofs[dof] for dof in order),
        system=replace(
            system,
            **{
                key: getattr(system, key)[order] for key in ("mass", "rotation", "held")
            },
            **{key: getattr(system, key)[both] for key in ("damping", "stiffness")},
            meshes=(replace(mesh, touched=places[mesh.touched]),),
            reference=pinion,
            angles=(pinion,),
        ),
        torques=tuple(torques),
        friction_torque=pair.friction_torque[order],
    )


def assert_moves_as_a_line(pair, oversampling=5):
    """Check that a pair and the line of one mesh that is made of it have one motion."""
    solver = Solver(oversampling=oversampling, precision="float64", backend="nystroem")
    record = {"sampling_rate": RATE, "duration": 0.05, "channels": CHANNELS}
    line = as_line(pair)
    assert not line.equations.is_gear_pair
    found, expected = (integrate([each], solver, **record) for each in (line, pair))

    assert in_band_error(found.acceleration, expected.acceleration, RATE)[0] < 1e-5
    assert np.abs(found.angle - expected.angle).max() < 1e-7
    assert np.abs(found.contact_loss - expected.contact_loss).max() < 1e-3


def specimen_of(machine):
    """A set of gears within the grade of a machine."""
    return draw_specimen(
        np.random.default_rng(5),
        *machine.pair.gears.values(),
        machine.quality,
        others=further_gears(machine.gears, machine.meshes),
        n_mountings=len(machine.meshes) - 1,
    )


def run_of(machine, faults=(), **changes):
    """A run that begins between teeth."""
    start = Start(tooth_pinion=3, tooth_wheel=5, phase=0.3)
    return Run(system=machine, faults=tuple(faults), start=start, **changes)


def recorded(*runs):
    """Records of runs, none of which fails."""
    records = simulate_together(runs)
    assert all(isinstance(record, CleanRecord) for record in records), records
    return records


def with_solver(machine, **changes):
    """The machine with other options of its solver."""
    return replace(machine, solver=replace(machine.solver, **changes))


def spectrum(signal):
    """Spectrum of a signal of 0.1 s from 500 Hz to 15 kHz, ten hertz apart."""
    return np.fft.rfft(signal * np.hanning(len(signal)))[50:1500]
