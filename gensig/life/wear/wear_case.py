"""One gear pair that wears.

Which load each place of its flanks carries, new or worn, and how fast it is worn off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]

N_NODES = {
    "band": 101,
    "fixed_intervals": 51,
}  # the second is stiff, and does not converge anyhow
ERROR_PHASES = 32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WearCase:
    """A pair under one torque with its wear law; make it by ``wear_case``.

    ``mesh`` has new flanks, modified or not, and sound teeth, which go on bending as such.
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
        """Whether wear changes how fast the flanks wear."""
        return self.options.geometry == "worn" and (
            self.loads is not None or self.options.rule != "band"
        )

    @property
    def force(self) -> float:
        """Total force along the transverse line of action, N."""
        pinion = self.pair.pinion
        return self.torque / (
            pinion.base_radius
            if self.options.load_radius == "base"
            else pinion.pitch_radius
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Gears, slices and nodes of what is worn off."""
        return 2, len(self.mesh.slice_place), len(self.path.position)

    def new_flanks(self) -> Array:
        """No wear, (2, slice, node) m: pinion, wheel."""
        return np.zeros(self.shape)

    def under(self, torque: float) -> WearCase:
        """The same under another torque in N m."""
        return replace(self, torque=torque)

    def line_load(self, depth: Array) -> Array:
        """Load per width that each place of the flanks carries as it meshes, (slice, node) N/m,
        transverse.

        Raises
        ------
        GeometryError    where the mesh finds no settled contact
        """
        if self.loads is None:
            return np.full(depth.shape[1:], self.force / self.pair.face_width)
        return self.loads.line_load(
            depth if self.options.geometry == "worn" else self.new_flanks(), self.force
        )

    def pressure(self, line_load: Array, depth: Array) -> Array:
        """Largest Hertzian pressure of each place, (slice, node) Pa."""
        worn = depth if self.options.geometry == "worn" else None
        return hertz_pressure(self.path, line_load, self.material, worn)

    def wear_per_mesh(self, depth: Array) -> Array:
        """Depth that the next mesh takes off either flank, (2, slice, node) m, when ``depth`` is
        off already.
        """
        load = self.line_load(depth)
        pressure = load if self.options.rule == "band" else self.pressure(load, depth)
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
        return (
            np.nan
            if self.period is None
            else float(np.ptp(self.period.settled(depth, self.force).approach))
        )

    def judged(self, depth: Array) -> float:
        """What is compared with the threshold, m.

        The deepest place of either flank, or of both together.
        """
        return float(
            depth.sum(axis=0).max() if self.options.criterion == "sum" else depth.max()
        )


def wear_case(
    mesh: SlicedMesh,
    material: Material,
    options: WearOptions,
    torque: float,
    *,
    n_nodes: int | None = None,
) -> WearCase:
    """A pair that wears under the pinion's torque in N m; ``n_nodes`` along the path of contact,
    None as many as the rule needs.

    Raises
    ------
    ConfigError    for a torque that does not drive, a threshold deeper than the tooth, or a limit
        of the transmission error where one pair carries everything
    """
    pair, path = mesh.pair, flank_path(mesh.pair, n_nodes or N_NODES[options.rule])
    thinnest = min(tip_thickness(pair.pinion), tip_thickness(pair.wheel))
    if options.threshold >= thinnest:
        raise ConfigError(
            f"wear.threshold_um = {options.threshold * 1e6:g} is deeper than the tooth, whose "
            "tip is "
            f"{thinnest * 1e6:.4g} um thick; give less"
        )
    by_mesh = options.sharing == "mesh" or (
        options.sharing is None and pair.transverse_contact_ratio >= 1.0
    )
    if options.transmission_error_limit is not None and not by_mesh:
        raise ConfigError(
            "wear.transmission_error_limit_um: with a contact ratio of "
            f"{pair.transverse_contact_ratio:.4f}, below 1, "
            f"it needs wear.sharing=mesh"
        )
    roll = pair.base_pitch * (np.arange(ERROR_PHASES) + 0.5) / ERROR_PHASES
    return WearCase(
        mesh=mesh,
        material=material,
        options=options,
        path=path,
        torque=torque,
        loads=path_loads(mesh, path) if by_mesh else None,
        period=worn_contact(mesh, path, roll) if by_mesh else None,
    )


def tip_thickness(gear: Gear) -> float:
    """Thickness of the tooth at its tip circle, transverse, m."""
    return 2.0 * gear.half_tooth_angle_at(gear.tip_radius) * gear.tip_radius
