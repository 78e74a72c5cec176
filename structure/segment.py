"""A reinforced concrete segment by class and code: concrete, bars and the values that EN 1992-1-1 gives them.

A rectangular section one metre wide (per metre of tunnel), one layer of bars along the ring near each face.
"""

from __future__ import annotations

import math
import re
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from structure.inputs import Input
from structure.plausibility import SEGMENT, Usual

#: Strength classes of EN 1992-1-1, Table 3.1: of cylinders and of cubes [MPa].
ConcreteClass = Literal[
    "C12/15", "C16/20", "C20/25", "C25/30", "C30/37", "C35/45", "C40/50", "C45/55", "C50/60", "C55/67", "C60/75",
    "C70/85", "C80/95", "C90/105",
]  # fmt: skip
#: Strain of the steel at the largest force, by ductility class: EN 1992-1-1, Table C.1.
STEEL_STRAINS = {"A": 0.025, "B": 0.05, "C": 0.075}
FACES = ("outer", "inner")


class SegmentSection(Input):
    """Concrete and bars of a segment by class and code.

    Parameters
    ----------
    code : {"EN 1992-1-1"}
        EN 1992-1-1:2004, which gives the values that follow from the classes.
    concrete : str
        Strength class, as "C50/60".
    steel : str
        B, f_yk [MPa] from 400 to 600 and ductility class, as "B500B".
    cover_outer, cover_inner : float
        From each face to the bars along the ring [m].
    bar_diameter_outer, bar_diameter_inner : float
        [m].
    bar_spacing_outer, bar_spacing_inner : float
        From bar to bar along the tunnel [m].
    concrete_long_term_factor, concrete_partial_factor, steel_partial_factor : float
        alpha_cc, gamma_c and gamma_s [-]. Left out: 1.0, 1.5 and 1.15, which the code recommends in 3.1.6 and
        Table 2.1N; a National Annex may have others.

    Source: EN 1992-1-1:2004, 2.4.2.4, 3.1, 3.2, Annex C.
    """

    usual: ClassVar[Usual] = SEGMENT

    code: Literal["EN 1992-1-1"]
    concrete: ConcreteClass
    steel: str
    cover_outer: float = Field(gt=0)
    cover_inner: float = Field(gt=0)
    bar_diameter_outer: float = Field(gt=0)
    bar_diameter_inner: float = Field(gt=0)
    bar_spacing_outer: float = Field(gt=0)
    bar_spacing_inner: float = Field(gt=0)
    concrete_long_term_factor: float = Field(default=1.0, gt=0, le=1)
    concrete_partial_factor: float = Field(default=1.5, ge=1)
    steel_partial_factor: float = Field(default=1.15, ge=1)

    @field_validator("steel")
    @classmethod
    def _known_steel(cls, steel: str) -> str:
        found = re.fullmatch(r"B(\d+)([ABC])", steel)
        if found is None or not 400 <= int(found[1]) <= 600:
            raise ValueError(
                f"must be B, the yield strength in MPa from 400 to 600 and a class A, B or C, got {steel!r}; write it"
                " like 'B500B'"
            )
        return steel

    @model_validator(mode="after")
    def _check(self) -> SegmentSection:
        for face in FACES:
            spacing, diameter = getattr(self, f"bar_spacing_{face}"), getattr(self, f"bar_diameter_{face}")
            if spacing <= diameter:
                raise ValueError(
                    f"bar_spacing_{face} must exceed bar_diameter_{face} {diameter:g} m, got {spacing:g} m; it counts"
                    " from axis to axis"
                )
        return self

    def check_thickness(self, thickness: float) -> None:
        """Refuse bars that lie beyond the middle of a segment of that thickness [m]. Raises ValueError."""
        for face in FACES:
            if self.bar_depth(face) >= thickness / 2:
                raise ValueError(
                    f"cover_{face} and half of bar_diameter_{face} must be below half the thickness {thickness:g} m,"
                    f" got {self.bar_depth(face):g} m; the cover counts from the face to the bars near it"
                )

    def bar_depth(self, face: str) -> float:
        """From the face "outer" or "inner" to the axis of its bars [m]."""
        return getattr(self, f"cover_{face}") + getattr(self, f"bar_diameter_{face}") / 2

    def steel_area(self, face: str) -> float:
        """Steel near the face "outer" or "inner" [m2 per metre of tunnel]."""
        return math.pi * getattr(self, f"bar_diameter_{face}") ** 2 / 4 / getattr(self, f"bar_spacing_{face}")

    @property
    def concrete_strength(self) -> float:
        """f_ck [Pa]."""
        return 1e6 * int(self.concrete[1:].partition("/")[0])

    @property
    def concrete_design_strength(self) -> float:
        """f_cd = alpha_cc f_ck/gamma_c [Pa], Eq. (3.15)."""
        return self.concrete_long_term_factor * self.concrete_strength / self.concrete_partial_factor

    @property
    def concrete_mean_strength(self) -> float:
        """f_cm = f_ck + 8 MPa [Pa], Table 3.1."""
        return self.concrete_strength + 8e6

    @property
    def concrete_tensile_strength(self) -> float:
        """f_ctm [Pa], Table 3.1: 0.30 f_ck^(2/3) up to C50/60, 2.12 ln(1 + f_cm/10) beyond, in MPa."""
        strength = self.concrete_strength / 1e6
        return 1e6 * (0.30 * strength ** (2 / 3) if strength <= 50 else 2.12 * math.log(1 + (strength + 8) / 10))

    @property
    def concrete_modulus(self) -> float:
        """E_cm = 22 (f_cm/10)^0.3 GPa with f_cm in MPa [Pa], Table 3.1."""
        return 22e9 * (self.concrete_mean_strength / 10e6) ** 0.3

    @property
    def concrete_peak_strain(self) -> float:
        """eps_c2 [-], Table 3.1."""
        return 1e-3 * (2.0 + 0.085 * max(self.concrete_strength / 1e6 - 50, 0.0) ** 0.53)

    @property
    def concrete_strain_limit(self) -> float:
        """eps_cu2 [-], Table 3.1."""
        strength = self.concrete_strength / 1e6
        return 1e-3 * (2.6 + 35 * ((90 - strength) / 100) ** 4 if strength > 50 else 3.5)

    @property
    def concrete_exponent(self) -> float:
        """n [-] of the parabola, Table 3.1."""
        strength = self.concrete_strength / 1e6
        return 1.4 + 23.4 * ((90 - strength) / 100) ** 4 if strength > 50 else 2.0

    @property
    def steel_design_strength(self) -> float:
        """f_yd = f_yk/gamma_s [Pa], 3.2.7."""
        return 1e6 * int(self.steel[1:-1]) / self.steel_partial_factor

    @property
    def steel_modulus(self) -> float:
        """E_s [Pa], 3.2.7(4)."""
        return 200e9

    @property
    def steel_strain_limit(self) -> float:
        """eps_ud = 0.9 eps_uk [-], 3.2.7(2), with the least eps_uk of the ductility class."""
        return 0.9 * STEEL_STRAINS[self.steel[-1]]

    def concrete_stress(self, strain: np.ndarray) -> np.ndarray:
        """Stress [Pa] of the parabola-rectangle diagram, compression positive, no tension, Eq. (3.17) and (3.18)."""
        share = np.clip(strain / self.concrete_peak_strain, 0.0, 1.0)
        return self.concrete_design_strength * (1 - (1 - share) ** self.concrete_exponent)

    def steel_stress(self, strain: np.ndarray) -> np.ndarray:
        """Stress [Pa], compression positive: elastic, then horizontal at f_yd."""
        return np.clip(self.steel_modulus * strain, -self.steel_design_strength, self.steel_design_strength)
