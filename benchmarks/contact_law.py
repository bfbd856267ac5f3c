"""``python -m benchmarks.contact_law``: what the secant of the contact term costs against the full
non-linear law.

In gensig's dynamics the Weber-Banaschek contact compliance of a pair stays what it is under the
record's quasi-static pair load. Here the same equations are integrated with the compliance of
every pair following its own present load, and both are compared, torque by torque, sound and
with a fault. Prints Markdown tables.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from benchmarks._contact_law_motion import Mesh, mesh_at_loads, motion, static_approach
from benchmarks._measure import add_quick
from benchmarks._mesh_numbers import mesh_numbers
from gensig.dynamics._vector import LANES
from gensig.dynamics.decimation import decimator
from gensig.dynamics.pair import RunningPair
from gensig.faults.base import Fault, faulty_teeth
from gensig.faults.registry import read_faults
from gensig.mesh.face import slice_gaps
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.pair_table import flank_sides, pair_table
from gensig.mesh.tooth_table import ToothTable
from gensig.plan.request import read_request
from gensig.systems.pair_machine import GearPairMachine, running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run

Array = NDArray[np.float64]

TORQUES = (5, 20, 50, 100)  # N m on the pinion
FAULTS = ("healthy", "missing_tooth", "pitting")
CHANNEL = "pinion_y"
DURATION = 0.2  # s; six turns of the pinion
# of which are compared, the last ones; whole turns: every mesh harmonic has its own line
N_TURNS = 3
N_HARMONICS = 6
MOST_SHIFT = 5.0  # samples
N_LOADS, MORE_LOADS = 41, 81
LEAST_LOAD, MOST_LOAD = (
    1e-3,
    10.0,
)  # shares of the mesh force between which faces are shared anew
POINTS_PER_PITCH = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One machine with one fault at one torque."""

    torque: float
    fault: str
    system: GearPairMachine
    faults: tuple[Fault, ...]

    @property
    def running(self) -> RunningPair:
        """Perfect gears, tooth 0 of either entering at A at time 0.

        What ``GearPairMachine.simulate`` takes unasked.
        """
        return running_pair(Run(system=self.system, faults=self.faults))

    @property
    def roll(self) -> Array:
        """Phases of one turn of the pinion, (phase,) m along the line of action."""
        pair = self.system.pair
        return (
            pair.base_pitch
            * (np.arange(pair.pinion.n_teeth * POINTS_PER_PITCH) + 0.5)
            / POINTS_PER_PITCH
        )


@lru_cache(maxsize=64)
def case(torque: float, fault: str, *changes: str) -> Case:
    """The default pair at its default speed."""
    words = [
        f"operating.torque_nm={torque:g}",
        f"operating.duration_s={DURATION:g}",
        f"fault={fault}",
    ]
    # the tooth bends as one piece: only the contact shall differ
    own = (
        "solver.oversampling=8",
        "solver.max_error=null",
        "mesh.bending=whole",
        f"sensing.channels=[{CHANNEL}]",
    )
    config = read_request([*words, *own, *changes]).config
    return Case(
        torque=torque,
        fault=fault,
        system=read_system(config),
        faults=tuple(read_faults(config["fault"])),
    )


@lru_cache(maxsize=64)
def mesh_of(this: Case, law: str, n_loads: int = N_LOADS) -> Mesh:
    """The mesh under one of three laws.

    ``secant``: gensig's own table, whatever the load. ``full``: the logarithm follows the
    pair's present load, over
    the width that bears under its quasi-static load. ``reshared``: and so does the share of
    each slice of a faulty
    flank; more slices bear under more load.
    """
    table, n = this.system.mesh_table(this.faults), n_loads if law == "reshared" else 2
    loads = this.system.mesh_force * np.geomspace(LEAST_LOAD, MOST_LOAD, n)
    secant = mesh_at_loads(table, loads)
    if law == "secant":
        return secant
    compliance = secant.compliance + change_with_load(
        this, table, loads[:, None], resharing=law == "reshared"
    )
    return secant._replace(
        compliance=compliance, slope=np.gradient(compliance, table.position, axis=2)
    )


def change_with_load(
    this: Case, table: ToothTable, loads: Array, *, resharing: bool
) -> Array:
    """Contact compliance at loads, (load, 1) N, less that at the table's, (kind, load, node) m/N,
    by pinion tooth.
    """
    system = this.system
    arguments = system.pair, table.position, system.material, system.mesh
    width, force = system.pair.pinion.face_width, system.mesh_force
    law = flank_sides(*arguments, force)["pinion"].law
    of_pinion = table.parts[0].compliance[0, 0, 0]
    heavy = pair_table(system.pair, system.material, system.mesh, load=force)
    at_force = heavy.parts[0].compliance[0, 0, 0]
    # the load at which the secant was taken, from what it costs
    own = force * np.exp((at_force - of_pinion) * width / law.factor * law.log_weight)
    side = flank_sides(*arguments, own)["pinion"]
    sound = law.compliance(width, loads) - law.compliance(width, own)
    change = np.repeat(sound[None], len(table.pinion.present), axis=0)
    for (_, number), tooth in faulty_teeth(system.pair, this.faults).items():
        if not tooth.present:
            continue
        gaps = slice_gaps(tooth, side.contacts)
        gaps -= gaps.min(axis=0)
        secant = side.contact(tooth, np.zeros_like(table.position), system.mesh)[1]
        bearing = tooth.slice_width @ (gaps < own * secant)
        if resharing:
            order = np.argsort(gaps, axis=0, kind="stable")
            widths = tooth.slice_width[order]
            moments = np.cumsum(
                widths * np.take_along_axis(gaps, order, axis=0), axis=0
            )
            carried = (
                loads * law.compliance(bearing, loads) * bearing
            )  # load x unit compliance
            # the approach at which the first n slices would carry the load; the least of them
            # is the true one
            pressed = np.min(
                [
                    (carried + m) / w
                    for m, w in zip(moments, widths.cumsum(axis=0), strict=True)
                ],
                axis=0,
            )
            change[table.pinion.kind[number]] = pressed / loads - secant
        else:
            change[table.pinion.kind[number]] = law.compliance(
                bearing, loads
            ) - law.compliance(bearing, own)
    return change


@lru_cache(maxsize=128)
def record(
    this: Case, law: str, *, oversampling: int = 8, n_loads: int = N_LOADS
) -> Array:
    """Acceleration along the line of action over the last turns of the pinion, decimated,
    (sample,) m/s2.
    """
    running, low_pass = this.running, decimator(oversampling)
    rate = this.system.sensing.sampling_rate
    step = 1.0 / (rate * oversampling)
    n_samples, n_settle = (
        round(DURATION * rate),
        math.ceil(running.dynamics.settling_time * rate),
    )
    first = -(low_pass.margin + n_settle)
    velocity = motion(
        mesh_of(this, law, n_loads),
        mesh_numbers(running),
        running,
        running.dynamics.static_start(first / rate),
        step=step,
        first_step=first * oversampling,
        n_steps=(n_settle + n_samples + 2 * low_pass.margin) * oversampling,
    )
    n_means = (n_samples + 2 * low_pass.margin) * oversampling + 1
    means = np.repeat(np.diff(velocity)[-n_means:, None, None] / step, LANES, axis=2)
    return last_turns(this, low_pass.apply(means)[0, 0])


def last_turns(this: Case, signal: Array) -> Array:
    """The part of a record, (sample,), that is compared."""
    return signal[
        -round(
            N_TURNS
            * this.system.sensing.sampling_rate
            * 2.0
            * math.pi
            / this.system.operating.speed
        ) :
    ]


def static(this: Case, law: str) -> tuple[Array, Array]:
    """Approach and tangent stiffness under the set torque over one turn of the pinion, (phase,) m
    and N/m.
    """
    running, roll = this.running, this.roll
    approach, stiffness = np.empty_like(roll), np.empty_like(roll)
    highest = (
        4.0
        * static_mesh(
            running.table, pair_states(running.table, roll), running.mesh_force
        ).approach.max()
    )
    numbers = mesh_numbers(running)
    static_approach(
        mesh_of(this, law),
        numbers,
        roll,
        running.mesh_force,
        highest,
        approach,
        stiffness,
    )
    return approach, stiffness


def resonance(this: Case, stiffness: float) -> float:
    """Natural frequency of the mesh mode, Hz."""
    values = this.running.equations.rates(np.array([stiffness]))
    return float(np.abs(values.imag).max() / (2.0 * math.pi))


def rms(signal: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(signal**2)))


def away(signal: Array, reference: Array) -> float:
    """RMS of the difference over the RMS of the reference."""
    return rms(signal - reference) / rms(reference)


def delayed(signal: Array, reference: Array) -> tuple[float, float]:
    """The difference that is left once ``signal`` is shifted as a whole turn, and the shift in
    samples.

    The drive is soft: 1e-3 N m more mean torque turns the pinion by 3 mrad, so that all happens
    17 us later, a sixth
    of a period of the mesh mode, and nothing else changes.
    """
    ours = np.fft.rfft(signal)
    turn = 2j * np.pi * np.arange(len(ours)) / len(signal)

    def left(shift: float) -> float:
        return away(np.fft.irfft(ours * np.exp(turn * shift), len(signal)), reference)

    near = min(np.arange(-MOST_SHIFT, MOST_SHIFT, 0.1), key=left)
    best = minimize_scalar(
        left, bounds=(near - 0.1, near + 0.1), method="bounded", options={"xatol": 1e-4}
    )
    return float(best.fun), float(best.x)


def harmonics(signal: Array) -> Array:
    """Amplitudes of the first mesh harmonics of whole turns of the 23-tooth pinion, (harmonic,)
    m/s2.
    """
    n_meshes = N_TURNS * case(TORQUES[0], FAULTS[0]).system.pair.pinion.n_teeth
    return (
        np.abs(np.fft.rfft(signal))[n_meshes * np.arange(1, N_HARMONICS + 1)]
        * 2.0
        / len(signal)
    )


def static_rows() -> Iterator[Sequence[str]]:
    """Statics of both laws."""
    for torque in TORQUES:
        for fault in FAULTS:
            this = case(torque, fault)
            (x, k), (x_full, k_full) = static(this, "secant"), static(this, "full")
            f, f_full = resonance(this, k.mean()), resonance(this, k_full.mean())
            approach = f"{x.mean() * 1e6:.3f} {x_full.mean() * 1e6:.3f}"
            swing = f"{np.ptp(x) * 1e6:.3f} {np.ptp(x_full) * 1e6:.3f}"
            stiffness = (
                f"{k.mean() * 1e-8:.3f} {k_full.mean() * 1e-8:.3f} | "
                f"{percent(k_full.mean() / k.mean() - 1.0)}"
            )
            yield (
                f"{torque}",
                fault,
                approach,
                swing,
                stiffness,
                f"{f:.0f} {f_full:.0f}",
                percent(f_full / f - 1.0),
            )


def dynamic_rows() -> Iterator[Sequence[str]]:
    """Records of the secant and the full law; for a pit also with its face shared anew."""
    for torque in TORQUES:
        for fault, law in [(fault, "full") for fault in FAULTS] + [
            ("pitting", "reshared")
        ]:
            this = case(torque, fault)
            secant, full = record(this, "secant"), record(this, law)
            left, shift = delayed(secant, full)
            yield (
                f"{torque}",
                fault + (", face shared anew" if law == "reshared" else ""),
                f"{rms(secant):.2f} {rms(full):.2f}",
                percent(rms(full) / rms(secant) - 1.0),
                " ".join(
                    percent(value)
                    for value in harmonics(full) / harmonics(secant) - 1.0
                ),
                f"{100 * away(secant, full):.2f} {100 * left:.2f}",
                f"{shift / this.system.sensing.sampling_rate * 1e6:+.2f}",
            )


def check_rows() -> Iterator[Sequence[str]]:
    """Checks of the reference: relative differences that should be 0."""
    for fault in FAULTS:
        own = [case(torque, fault) for torque in TORQUES]
        gensigs = [
            last_turns(c, c.system.simulate(c.faults).acceleration[0]) for c in own
        ]
        simulated = [
            away(record(c, "secant"), theirs)
            for c, theirs in zip(own, gensigs, strict=True)
        ]
        this, linear = own[1], case(20, fault, "mesh.contact=linear")
        theirs = static_mesh(
            this.running.table,
            pair_states(this.running.table, this.roll),
            this.running.mesh_force,
        )
        approach, stiffness = static(this, "secant")
        finer = [
            away(*(record(c, "full", oversampling=n) for n in (8, 16)))
            for c in own[1::2]
        ]
        pitted = own[1::2] if fault == "pitting" else []
        loads = [
            away(*(record(c, "reshared", n_loads=n) for n in (N_LOADS, MORE_LOADS)))
            for c in pitted
        ]
        yield (
            fault,
            " ".join(f"{value:.0e}" for value in simulated),
            f"{np.abs(approach / theirs.approach - 1.0).max():.0e}",
            f"{np.abs(stiffness / theirs.stiffness - 1.0).max():.0e}",
            f"{away(record(linear, 'full'), record(linear, 'secant')):.0e}",
            " ".join(f"{value:.0e}" for value in finer),
            " ".join(f"{value:.0e}" for value in loads),
        )


def percent(value: float) -> str:
    """A change in percent."""
    return f"{100.0 * value:+.2f}"


def table(head: str, rows: Iterator[Sequence[str]]) -> None:
    """Print a Markdown table as it is computed."""
    print(f"{head}\n|{'---|' * (head.count('|') - 1)}")
    for row in rows:
        print(f"| {' | '.join(row)} |", flush=True)
    print()


def main() -> None:
    """Print every table."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_quick(parser)
    n_rows = 1 if parser.parse_args().quick else None
    begun = time.perf_counter()
    print(
        "Static, secant and full law: approach in um, tangent stiffness in 1e8 N/m, mesh "
        "resonance in Hz\n"
    )
    table(
        "| N m | fault | mean | peak to peak | mean stiffness | % | resonance | % |",
        islice(static_rows(), n_rows),
    )
    print(
        f"{CHANNEL} in m/s2, secant and full law; changes from the secant; difference "
        "over the full law's RMS\n"
    )
    head = (
        "| N m | fault | RMS | % | mesh harmonics 1..6, % | difference, once shifted, % | "
        "shift, us |"
    )
    table(head, islice(dynamic_rows(), n_rows))
    print(
        f"Differences that should be none; records at {TORQUES} N m, finer ones at "
        f"{TORQUES[1::2]}, the rest at 20\n"
    )
    table(
        "| fault | secant, gensig's record | static approach | stiffness | linear "
        "contact: full, secant | "
        "full, 8 and 16 steps a sample | face shared anew, 41 and 81 loads |",
        islice(check_rows(), n_rows),
    )
    print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
