"""One gear pair that wears: load of each node of its flanks, new or worn, and rate of wear."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.life.options import WearOptions
from gensig.life.wear.archard import (
    FlankPath,
    depth_per_mesh,
    flank_path,
    hertz_pressure,
    meshes_per_turn,
)
from gensig.life.wear.worn_contact import (
    PathLoads,
    WornContact,
    path_loads,
    worn_contact,
)
from gensig.material import Material
from gensig.mesh.sliced.slices import SlicedMesh

# the second is stiff, and does not converge anyhow
N_NODES = {"band": 101, "fixed_intervals": 51}
ERROR_PHASES = 32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WearCase:
    """Pair under one torque with its wear law; made by ``wear_case``.

    ``mesh`` has new flanks, modified or not, and healthy teeth, which go on bending as such.
    ``loads`` and ``period`` (over one mesh period) are its prepared contact, None where one pair
    carries everything.
    """

    mesh: SlicedMesh
    material: Material
    options: WearOptions
    path: FlankPath
    torque: float
    loads: PathLoads | None
    period: WornContact | None

    def __post_init__(self) -> None:
        if not self.torque > 0.0:
            raise ConfigError(
                f"operating.torque_nm = {self.torque:g} must be positive: flanks that bear "
                "nothing last"
            )

    @property
    def pair(self) -> GearPair:
        """The gears in mesh."""
        return self.mesh.pair

    @property
    def follows_wear(self) -> bool:
        """True where wear changes the rate of wear."""
        return self.options.geometry == "worn" and (
            self.loads is not None or self.options.rule != "band"
        )

    @property
    def force(self) -> float:
        """Total force along the transverse line of action, N."""
        pinion = self.pair.pinion
        radius = pinion.pitch_radius
        if self.options.load_radius == "base":
            radius = pinion.base_radius
        return self.torque / radius

    @property
    def shape(self) -> tuple[int, int, int]:
        """Gears, slices and nodes of what is worn off."""
        return 2, len(self.mesh.slice_middle), len(self.path.position)

    def new_flanks(self) -> Array:
        """No wear, (2, slice, node) m: pinion, wheel."""
        return np.zeros(self.shape)

    def with_torque(self, torque: float) -> WearCase:
        """Same case with another torque in N m."""
        return replace(self, torque=torque)

    def line_load(self, depth: Array) -> Array:
        """Load per width of each node of the flanks as it meshes, (slice, node) N/m, transverse.

        Raises
        ------
        GeometryError    where the mesh finds no settled contact
        """
        if self.loads is None:
            return np.full(depth.shape[1:], self.force / self.pair.face_width)
        if self.options.geometry != "worn":
            depth = self.new_flanks()
        return self.loads.line_load(depth, self.force)

    def pressure(self, line_load: Array, depth: Array) -> Array:
        """Largest Hertzian pressure of each node, (slice, node) Pa."""
        worn = None
        if self.options.geometry == "worn":
            worn = depth
        return hertz_pressure(self.path, line_load, self.material, worn)

    def wear_per_mesh(self, depth: Array) -> Array:
        """Depth that the next mesh takes off either flank, (2, slice, node) m.

        ``depth`` is off already.
        """
        load = pressure = self.line_load(depth)
        if self.options.rule != "band":
            pressure = self.pressure(load, depth)
        return depth_per_mesh(self.path, load, pressure, self.options)

    def rate(self, depth: Array) -> Array:
        """Depth per turn of the pinion, (2, slice, node) m.

        A wheel's tooth meshes z1 / z2 times in it.
        """
        return self.wear_per_mesh(depth) * meshes_per_turn(self.pair)[:, None, None]

    def error_range(self, depth: Array) -> float:
        """Static transmission error under load, from peak to peak over a mesh period, m.

        NaN where one pair carries.
        """
        if self.period is None:
            return np.nan
        return float(np.ptp(self.period.settled(depth, self.force).approach))

    def judged(self, depth: Array) -> float:
        """Depth that is compared with the threshold, m.

        It is that of the deepest node of either flank, or of both together.
        """
        if self.options.criterion == "sum":
            depth = depth.sum(axis=0)
        return float(depth.max())


def wear_case(
    mesh: SlicedMesh,
    material: Material,
    options: WearOptions,
    torque: float,
    *,
    n_nodes: int | None = None,
) -> WearCase:
    """Pair that wears under the pinion's torque in N m.

    ``n_nodes`` are along the path of contact; None takes as many as the rule needs.

    Raises
    ------
    ConfigError    for a torque that does not drive, a threshold deeper than the tooth, or a limit
        of the transmission error where one pair carries everything
    """
    pair, path = mesh.pair, flank_path(mesh.pair, n_nodes or N_NODES[options.rule])
    thinnest = min(tip_thickness(pair.pinion), tip_thickness(pair.wheel))
    if options.threshold >= thinnest:
        raise ConfigError(
            f"wear.threshold_um = {options.threshold * 1e6:g} is deeper than the tooth, whose tip "
            f"is {thinnest * 1e6:.4g} um thick; give less"
        )
    ratio = pair.transverse_contact_ratio
    loads = period = None
    if options.sharing == "mesh" or (options.sharing is None and ratio >= 1.0):
        roll = pair.base_pitch * (np.arange(ERROR_PHASES) + 0.5) / ERROR_PHASES
        loads, period = path_loads(mesh, path), worn_contact(mesh, path, roll)
    elif options.transmission_error_limit is not None:
        raise ConfigError(
            f"wear.transmission_error_limit_um: with a contact ratio of {ratio:.4f}, below 1, "
            "it needs wear.sharing=mesh"
        )
    return WearCase(
        mesh=mesh,
        material=material,
        options=options,
        path=path,
        torque=torque,
        loads=loads,
        period=period,
    )


def tip_thickness(gear: Gear) -> float:
    """Thickness of the tooth at its tip circle, transverse, m."""
    return 2.0 * gear.half_tooth_angle_at(gear.tip_radius) * gear.tip_radius
