"""Linear elastic soil, which never yields; its strength is that of the ring's soil springs alone."""

from typing import Literal

from pydantic import Field, model_validator

from mpm.laws.soil import Soil
from mpm.laws.stress import elastic_trial
from mpm.quantities import Angle, Pressure, Time


class Elastic(Soil):
    """Hooke's law, rate form, in plane strain.

    Parameters
    ----------
    youngs_modulus : float
        [Pa]
    cohesion, friction_angle, dilatancy_angle, tensile_strength : float
        [Pa], [deg], [deg], [Pa]. An elastic soil does not read them, the soil springs of a ring in it do.
    relaxation_time : float
        Of Mohr-Coulomb soil [s].
    """

    model: Literal["elastic"]
    youngs_modulus: Pressure = Field(ge=1e4, le=1e11)
    cohesion: Pressure = Field(ge=0, le=1e8)
    friction_angle: Angle = Field(ge=0, lt=60)
    dilatancy_angle: Angle = Field(ge=0, lt=60)
    tensile_strength: Pressure = Field(default=0.0, ge=0, le=1e8)
    relaxation_time: Time = Field(default=0.0, ge=0, le=1)

    helpers = (elastic_trial,)

    @model_validator(mode="after")
    def _check_dilatancy(self):
        if self.dilatancy_angle > self.friction_angle:
            raise ValueError(
                f"soil '{self.name}': dilatancy_angle {self.dilatancy_angle:g} deg must not exceed friction_angle "
                f"{self.friction_angle:g} deg; the flow rule would create energy"
            )
        return self

    @property
    def constants(self):
        """Lame's first constant and the shear modulus [Pa]."""
        shear = self.youngs_modulus / (2 * (1 + self.poissons_ratio))
        return {"lame": 2 * shear * self.poissons_ratio / (1 - 2 * self.poissons_ratio), "shear": shear}

    @property
    def in_words(self):
        """Elastic parameters."""
        return f"E {self.youngs_modulus / 1e6:g} MPa, ν {self.poissons_ratio:g}"

    @property
    def strength(self):
        """Cohesion [Pa] and friction angle [deg]."""
        return self.cohesion, self.friction_angle

    def youngs_modulus_at(self, vertical_stress):
        """Young's modulus [Pa], the same under any stress."""
        return self.youngs_modulus

    @staticmethod
    def new_stress(stress, strain, point, soil, dt):
        """The stress after a strain; never at a limit."""
        return elastic_trial(stress, strain, soil.lame, soil.shear), False

    @staticmethod
    def moduli(point, soil):
        """Lame's first constant and the shear modulus [Pa]."""
        return soil.lame, soil.shear
