"""Torques of an engine on the nodes of its shaft line, over one cycle of the crank, at a speed
and a load.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from gensig.arrays import Array
from gensig.driveline.excitation.cams import Cam, cam_torque
from gensig.driveline.excitation.cycle import (
    CYCLE,
    Cylinder,
    cycle_angles,
    delayed,
    gas_torque,
    inertia_torque,
)
from gensig.driveline.excitation.firing import Layout
from gensig.driveline.excitation.injection_pump import Plunger, plunger_torque
from gensig.driveline.excitation.line_torques import (
    LAWS,
    POINTS,
    LineTorques,
    Load,
    Reference,
    by_node,
    load_torques,
)
from gensig.driveline.excitation.pressure import (
    PressureFile,
    WiebeCycle,
    read_pressure,
    wiebe_parts,
)
from gensig.errors import ConfigError
from gensig.units import unit

CAM_RATIO = 0.5  # of a four-stroke engine's camshaft to its crank
ROUNDS = 50
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Dynamometer:
    """Takes the brake torque, with a disturbance of a share of it at a frequency of its own."""

    node: int
    disturbance_share: float
    disturbance_frequency: float = unit("hz")

    def __post_init__(self) -> None:
        if not 0.0 <= self.disturbance_share <= 1.0:
            raise ConfigError(
                "excitation.dynamometer.disturbance_share = "
                f"{self.disturbance_share:g} must lie in 0..1"
            )
        if not self.disturbance_frequency > 0.0:
            raise ConfigError(
                "excitation.dynamometer.disturbance_frequency_hz = "
                f"{self.disturbance_frequency:g} must be positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveTrain:
    """Cams that open at a crank angle after their cylinder's firing top dead center.

    ``cam.span`` says how long.
    """

    opening: float = unit("deg")
    cam: Cam


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """A four-stroke engine as configured.

    ``throw_nodes`` (throw,) are the nodes of the throws; ``valve_nodes`` gives for each bank the
    nodes of its cams by throw, ``plunger_nodes`` for each cylinder that of its plunger. Either
    may be empty.
    """

    cylinder: Cylinder
    layout: Layout
    pressure: WiebeCycle | PressureFile
    crankcase_pressure: float
    friction_mean_pressure: float
    reference: Reference
    throw_nodes: tuple[int, ...]
    valve_trains: Mapping[str, ValveTrain]
    valve_nodes: Mapping[str, tuple[int, ...]]
    plunger: Plunger | None
    plunger_nodes: Mapping[str, int]
    loads: Mapping[str, Load]
    dynamometer: Dynamometer

    def __post_init__(self) -> None:
        n_throws = len(self.layout.throw_angles)
        if len(self.throw_nodes) != n_throws or len(set(self.throw_nodes)) != n_throws:
            raise ConfigError(
                f"excitation.throw_nodes has {len(set(self.throw_nodes))} different "
                f"nodes for {n_throws} throws of "
                "excitation.layout.throw_angles_deg"
            )
        for bank, nodes in self.valve_nodes.items():
            if bank not in self.layout.banks:
                raise ConfigError(
                    f"excitation.valve_nodes: no bank {bank!r}; there are "
                    f"{', '.join(self.layout.banks)}"
                )
            if len(nodes) not in (0, n_throws):
                raise ConfigError(
                    f"excitation.valve_nodes.{bank} has {len(nodes)} nodes for {n_throws} throws"
                )
        for name in self.plunger_nodes:
            if name not in self.layout.cylinders:
                raise ConfigError(
                    f"excitation.injection_pump.cylinders: there is no cylinder {name!r}"
                )
        for key, value in (
            ("crankcase_pressure_mpa", self.crankcase_pressure),
            ("friction_mean_pressure_mpa", self.friction_mean_pressure),
        ):
            if not value >= 0.0:
                raise ConfigError(
                    f"excitation.{key} = {value * 1e-6:g} must not be negative"
                )

    @property
    def pressure_decides_torque(self) -> bool:
        """True with a measured pressure, which gives the torque of the engine."""
        return isinstance(self.pressure, PressureFile)

    @property
    def driving_nodes(self) -> tuple[int, ...]:
        """Numbers of the nodes that what speeds the line up comes from.

        Speeds are those of the first.
        """
        return self.throw_nodes

    @property
    def load_node(self) -> int:
        """Number of the node at which the set torque is taken."""
        return self.dynamometer.node

    @property
    def load_exponent(self) -> int:
        """Power of the speed by which the set torque changes along a course.

        A dynamometer holds it.
        """
        return LAWS["constant"]

    def dampers(self, ratios: Mapping[int, float]) -> dict[int, float]:
        """Slopes of torque over speed by node, N m s/rad, beyond the tables over the cycle.

        None.
        """
        return {}

    @property
    def friction_torque(self) -> float:
        """Of the whole engine at the crank, N m: mean pressure times swept volume over 4 pi."""
        volume = self.cylinder.swept_volume * len(self.layout.cylinders)
        return self.friction_mean_pressure * volume / CYCLE


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineTorques(LineTorques):
    """Torques of an engine at one operating point.

    ``angle`` (point,) rad are the crank angles of one cycle. ``pressure`` (point,) Pa is that of
    a cylinder from its own firing top dead center on, ``fuel_volume`` m3 what it burns in a
    cycle. ``brake_torque`` and ``indicated_torque`` are those of the whole engine at the crank, N
    m. The disturbance is a torque of its own frequency, not one over the cycle.
    """

    indicated_torque: float
    fuel_volume: float
    angle: Array
    pressure: Array
    disturbance_node: int
    disturbance_torque: float
    disturbance_frequency: float


def engine_torques(
    engine: Engine,
    speed: float,
    torque: float | None,
    ratios: Mapping[int, float],
    *,
    n_points: int = POINTS,
) -> EngineTorques:
    """Torques on the shaft line at a speed and a brake torque.

    Parameters
    ----------
    speed : rad/s      of the crank
    torque : N m       brake torque at the crank; None with a measured pressure
    ratios : speed of each node over the crank's
    n_points : of the cycle

    Raises
    ------
    ConfigError    for a torque below the friction, unknown nodes, or a camshaft at another ratio

    Notes
    -----
    The gas does the work of brake, friction, cams, plungers and driven machines: means balance.
    """
    _check_nodes(engine, ratios)
    if not speed > 0.0:
        raise ConfigError(
            f"the speed of the crank, {speed * 30.0 / math.pi:g} r/min, must be positive"
        )
    share = speed / engine.reference.speed
    parts = [
        *load_torques(engine.loads, share),
        *_valve_torques(engine, speed, n_points),
    ]
    driven = sum(ratios[node] * float(np.mean(row)) for node, row in parts)
    taken = engine.friction_torque - driven
    plunger_at = partial(_plunger_torque, engine, speed, share, n_points=n_points)
    work = partial(_measured, engine)
    if isinstance(engine.pressure, WiebeCycle):
        work = partial(_burned, engine, speed)
    pressure, indicated, brake = work(torque, taken, plunger_at, n_points)
    volume = _fuel(engine, indicated)
    pulses, firing = plunger_at(volume), engine.layout.firing_angles()
    plungers = engine.plunger_nodes.items()
    parts += [(node, delayed(pulses, firing[name])) for name, node in plungers]
    dynamometer, load_ratio = engine.dynamometer, ratios[engine.dynamometer.node]
    parts.append((dynamometer.node, np.array(-brake / load_ratio)))
    parts += _cylinder_torques(engine, pressure, speed)
    nodes, torques = by_node(parts, n_points)
    return EngineTorques(
        speed=speed,
        brake_torque=brake,
        indicated_torque=indicated,
        fuel_volume=volume,
        angle=cycle_angles(n_points),
        pressure=pressure,
        nodes=nodes,
        torque=torques,
        disturbance_node=dynamometer.node,
        disturbance_torque=dynamometer.disturbance_share * brake / load_ratio,
        disturbance_frequency=dynamometer.disturbance_frequency,
    )


def _check_nodes(engine: Engine, ratios: Mapping[int, float]) -> None:
    """Every node is there, throws turn with the crank, cams at half its speed."""
    cams = list(chain(*engine.valve_nodes.values(), engine.plunger_nodes.values()))
    wanted: list[tuple[str, Iterable[int], float | None]] = [
        ("throw_nodes", engine.throw_nodes, 1.0),
        ("valve_nodes or injection_pump.nodes", cams, CAM_RATIO),
        *((f"loads.{name}.node", [x.node], None) for name, x in engine.loads.items()),
        ("dynamometer.node", [engine.dynamometer.node], None),
    ]
    expanded = [(key, node, ratio) for key, nodes, ratio in wanted for node in nodes]
    for key, node, ratio in expanded:
        if node not in ratios:
            raise ConfigError(f"excitation.{key}: the shaft line has no node {node}")
        if ratio is not None and not math.isclose(ratios[node], ratio, rel_tol=1e-9):
            raise ConfigError(
                f"excitation.{key}: node {node} turns {ratios[node]:.6g} times as "
                f"fast as the crank; it needs {ratio:g}"
            )


def _valve_torques(
    engine: Engine, speed: float, n_points: int
) -> list[tuple[int, Array]]:
    """Torques of the valve cams on their nodes, (point,) each."""
    firing, parts = engine.layout.firing_angles(), []
    for train in engine.valve_trains.values():
        angle = CAM_RATIO * (cycle_angles(n_points) - train.opening)
        unshifted = cam_torque(train.cam, angle, CAM_RATIO * speed)
        for bank, nodes in engine.valve_nodes.items():
            parts += [
                (node, delayed(unshifted, firing[f"{bank}{throw + 1}"]))
                for throw, node in enumerate(nodes)
            ]
    return parts


def _plunger_torque(
    engine: Engine, speed: float, speed_share: float, volume: float, *, n_points: int
) -> Array:
    """Torque of the plunger of a cylinder that fires at crank angle 0 on its node, (point,)."""
    if engine.plunger is None:
        return np.zeros(n_points)
    angle = CAM_RATIO * (cycle_angles(n_points) - engine.plunger.delivery_begin)
    return plunger_torque(engine.plunger, angle, CAM_RATIO * speed, volume, speed_share)


def _cylinder_torques(
    engine: Engine, pressure: Array, speed: float
) -> list[tuple[int, Array]]:
    """Gas, inertia and friction torques of the cylinders on the throws, (point,) each."""
    angle = cycle_angles(len(pressure))
    torque = gas_torque(engine.cylinder, angle, pressure, engine.crankcase_pressure)
    torque = torque + inertia_torque(engine.cylinder, angle, speed)
    torque = torque - engine.friction_torque / len(engine.layout.cylinders)
    firing = engine.layout.firing_angles()
    return [
        (engine.throw_nodes[engine.layout.throw(name)], delayed(torque, firing[name]))
        for name in engine.layout.cylinders
    ]


def _fuel(engine: Engine, indicated: float) -> float:
    """Fuel of one cylinder and cycle, m3, at an indicated torque of the engine, N m."""
    if engine.plunger is None:
        return 0.0
    return engine.plunger.fuel_volume(indicated * CYCLE / len(engine.layout.cylinders))


def _indicated(engine: Engine, pressure: Array) -> float:
    """Mean torque of the gas in all cylinders, N m."""
    angle = cycle_angles(len(pressure))
    torque = gas_torque(engine.cylinder, angle, pressure, engine.crankcase_pressure)
    return float(np.mean(torque)) * len(engine.layout.cylinders)


def _taken_by(engine: Engine, torque: Array) -> float:
    """Mean torque of all plungers at the crank, N m."""
    return -CAM_RATIO * len(engine.plunger_nodes) * float(np.mean(torque))


def _measured(
    engine: Engine,
    torque: float | None,
    taken: float,
    plunger_at: partial[Array],
    n_points: int,
) -> tuple[Array, float, float]:
    """Pressure, indicated and brake torque with a measured pressure."""
    assert isinstance(engine.pressure, PressureFile)
    if torque is not None:
        raise ConfigError(
            f"a torque of {torque:g} N m is given with excitation.pressure.file, "
            "which decides it; leave the torque out"
        )
    pressure = read_pressure(engine.pressure, n_points)
    indicated = _indicated(engine, pressure)
    lost = taken + _taken_by(engine, plunger_at(_fuel(engine, max(indicated, 0.0))))
    if not indicated > lost:
        raise ConfigError(
            f"excitation.pressure.file = {engine.pressure.file} gives {indicated:.4g} "
            f"N m, below the {lost:.4g} N m of "
            "friction and drives; lower friction_mean_pressure_mpa or give another pressure"
        )
    return pressure, indicated, indicated - lost


def _burned(
    engine: Engine,
    speed: float,
    torque: float | None,
    taken: float,
    plunger_at: partial[Array],
    n_points: int,
) -> tuple[Array, float, float]:
    """Pressure, indicated and brake torque with a Wiebe cycle."""
    assert isinstance(engine.pressure, WiebeCycle)
    if torque is None:
        raise ConfigError(
            "a Wiebe cycle needs the brake torque; only a measured pressure decides it"
        )
    if not torque >= 0.0:
        raise ConfigError(
            f"the brake torque {torque:g} N m is below the friction, which the engine "
            "overcomes itself; give 0 or more"
        )
    power_share = torque * speed / (engine.reference.torque * engine.reference.speed)
    motored, fired = wiebe_parts(
        engine.pressure, engine.cylinder, n_points, power_share
    )
    indicated = torque + taken
    for _ in range(ROUNDS):
        before = indicated
        pumped = _taken_by(engine, plunger_at(_fuel(engine, before)))
        indicated = torque + taken + pumped
        if abs(indicated - before) <= ROUNDING * indicated:
            break
    without = _indicated(engine, motored)
    unit_heat = _indicated(engine, engine.crankcase_pressure + fired)
    heat = (indicated - without) / unit_heat
    if not heat > 0.0:
        raise ConfigError(
            f"the torque of the gas, {indicated:.4g} N m with friction and drives, is "
            f"below the {without:.4g} N m that "
            "boost and exhaust give without fuel; raise the torque or lower boost_pressure_mpa"
        )
    return motored + heat * fired, indicated, torque
