"""What every soil layer has, whatever its law, and what a law must give.

A law is one file of this folder, or of a third party: a class derived from :class:`Soil` that adds the parameters of
the law, its history variables and constants, and two plain functions of numbers, which are compiled when a scene uses
them (`mpm.laws.law`).
"""

import math
from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import Field, field_validator, model_validator

from mpm.quantities import Density, Length, Part, Velocity


class Soil(Part):
    """One soil layer, from `top_depth` down to the next layer or the bottom.

    Parameters
    ----------
    model : str
        Name of the law: "mohr-coulomb", "elastic" .. (`mpm.soil_law_names`), of one registered
        (`mpm.register_soil_law`), or "FILE.py:CLASS".
    porosity, loose_porosity : float
        Of the initial state, and above which grains do not touch [-].
    grain_density, hydraulic_conductivity : float
        [kg/m3], Darcy's [m/s].
    poissons_ratio : float
        Of the elastic part of the law [-].
    k0 : float or None
        Horizontal over vertical effective stress of the initial state [-]. None: what loading an elastic body by
        gravity gives, see :meth:`lateral_pressure_coefficient`.

    Attributes
    ----------
    history : tuple of (name, unit, meaning)
        Class variable: numbers that a point carries for the law, beside those of `mpm.fields.POINT`. Stored with runs.
    constants : property, dict of str to float
        Numbers of the soil that the functions below read as ``soil.name``.
    new_stress : function
        Static, ``new_stress(stress, strain, point, soil, dt)`` -> (Stress, at_limit): effective stress after a step.
        `stress`, `strain` : `mpm.laws.stress.Stress` (turned with the material) and `Strain`; `point` : record of the
        point, whose history it may change, with the new porosity; `soil` : record of the constants; `dt` : [s],
        infinite in the drained initial state; `at_limit` : whether the tip of the strength acted, which is counted.
    moduli : function
        Static, ``moduli(point, soil)`` -> (lame, shear): the largest elastic stiffness that the point may have in the
        next step [Pa], which limits the time step.
    helpers : tuple of functions
        Class variable: functions that these two call, in an order in which each calls earlier ones only.
    """

    name: str = Field(max_length=60, pattern=r"^\w[\w .,()+-]*$")  # it is shown in tables, pages and pictures
    top_depth: Length = Field(ge=0)
    model: str
    porosity: float
    loose_porosity: float
    grain_density: Density = Field(gt=1000, lt=10000)
    hydraulic_conductivity: Velocity | None = None
    poissons_ratio: float = Field(ge=0, lt=0.5)
    k0: float | None = Field(default=None, gt=0, lt=5)

    history: ClassVar[tuple[tuple[str, str, str], ...]] = ()
    helpers: ClassVar[tuple[Callable[..., Any], ...]] = ()

    @field_validator("porosity")
    @classmethod
    def _check_porosity(cls, porosity, given):
        if not 0.05 < porosity < 0.9:
            raise ValueError(
                f"{_soil(given)}: porosity must lie in (0.05, 0.9), got {porosity:g}; give a fraction, not percent"
            )
        return porosity

    @field_validator("hydraulic_conductivity")
    @classmethod
    def _check_conductivity(cls, conductivity, given):
        if conductivity is not None and not 0 < conductivity <= 10:
            raise ValueError(
                f"{_soil(given)}: hydraulic_conductivity must lie in (0, 10] m/s, got {conductivity:g}; "
                "give the Darcy conductivity in m/s, sand about 1e-4"
            )
        return conductivity

    @model_validator(mode="after")
    def _check_loose(self):
        if not self.porosity < self.loose_porosity <= 0.9:
            raise ValueError(
                f"soil '{self.name}': loose_porosity (above it grains do not touch) must lie between porosity "
                f"{self.porosity:g} and 0.9, got {self.loose_porosity:g}; raise it"
            )
        return self

    def model_copy(self, *, update=None, deep=False):
        """A copy with other values, not validated; of another class and validated where `model` changes."""
        copy = super().model_copy(update=update, deep=deep)
        if copy.model == self.model:
            return copy
        from mpm.laws.law import soil_law  # which knows all laws

        return soil_law(copy.model).model_validate(copy.model_dump())

    # -- what a law gives -----------------------------------------------------------------------

    @property
    def constants(self) -> dict[str, float]:
        """Numbers of the law that its functions read."""
        raise NotImplementedError

    @property
    def in_words(self) -> str:
        """The law's parameters in a few words with units."""
        return f"ν {self.poissons_ratio:g}"

    @property
    def limits(self) -> str:
        """What of the law limits K0, in words with values; shown where K0 is refused."""
        return f"the law '{self.model}' of the soil"

    def youngs_modulus_at(self, vertical_stress: float) -> float:
        """Young's modulus [Pa] under a vertical effective stress [Pa]."""
        raise NotImplementedError

    @property
    def strength(self) -> tuple[float, float]:
        """Cohesion [Pa] and friction angle [deg] that a Mohr-Coulomb estimate of the soil takes."""
        raise NotImplementedError

    def admissible_k0(self, vertical_stress: Any) -> tuple[Any, Any]:
        """Lowest and highest k0 that the strength bears under vertical effective stresses [Pa] (float or array)."""
        return -math.inf, math.inf

    def initial_history(self, points: Any) -> None:
        """Set the history variables of points at rest, whose stresses are known, in place (records)."""

    # -- what follows ---------------------------------------------------------------------------

    def lateral_pressure_coefficient(self, vertical_stress):
        """K0 of the initial state under vertical effective stresses: horizontal over vertical effective stress [-].

        `k0` where it is given. Left out, it is that of an elastic body which gravity loads without lateral strain,
        nu / (1 - nu), raised to the lowest one that the law bears: of Mohr-Coulomb soil the active coefficient,
        sigma_h >= (sigma_v (1 - sin(phi)) - 2 c cos(phi)) / (1 + sin(phi)). The passive side is never reached, since
        nu < 0.5.

        Parameters
        ----------
        vertical_stress : float or (n,) float64
            Compression positive [Pa].

        Returns
        -------
        float or (n,) float64
        """
        if self.k0 is not None:
            return self.k0
        lowest = self.admissible_k0(vertical_stress)[0]
        if isinstance(lowest, int | float):
            return max(self.elastic_k0, lowest)
        import numpy as np  # reading a scene needs none

        return np.fmax(self.elastic_k0, lowest)

    @property
    def elastic_k0(self) -> float:
        """K0 of an elastic body that gravity loads without lateral strain, nu / (1 - nu) [-]."""
        return self.poissons_ratio / (1 - self.poissons_ratio)


def _soil(given) -> str:
    """The soil of a field that is checked, by its name where that is known by then."""
    return f"soil '{given.data['name']}'" if "name" in given.data else "soil"
