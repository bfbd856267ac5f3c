"""Elastic constants of the gear material."""

from __future__ import annotations

from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.units import check_positive, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Isotropic linear-elastic material."""

    youngs_modulus: float = unit("gpa")
    poisson_ratio: float
    density_kg_per_m3: float

    def __post_init__(self) -> None:
        check_positive(self, "material.", "youngs_modulus", "density_kg_per_m3")
        if not 0.0 <= self.poisson_ratio < 1.0:
            raise ConfigError(
                f"material.poisson_ratio = {self.poisson_ratio:g} must be at least 0 and below 1"
            )

    def in_plane(self, elasticity: str) -> Material:
        """Material whose plane-stress formulas describe this one under ``elasticity``.

        ``elasticity`` is ``plane_stress`` or ``plane_strain``. Plane strain is plane stress with
        E / (1 - nu^2) and nu / (1 - nu); the shear modulus stays.
        """
        if elasticity == "plane_stress":
            return self
        nu = self.poisson_ratio
        return Material(
            youngs_modulus=self.youngs_modulus / (1.0 - nu**2),
            poisson_ratio=nu / (1.0 - nu),
            density_kg_per_m3=self.density_kg_per_m3,
        )

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)), Pa."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
