"""A lining model of your own is one class: the homogeneous ring of equivalent stiffness (JSCE)."""

from pydantic import Field

from coupling import load_scene
from structure import BeamSpringLining, Ring, theory


class SoftenedRing(Ring):
    """A ring that bends with eta EI: the efficiency factor of its joints, from tests or a code."""

    efficiency: float = Field(gt=0, le=1)
    bending_stiffness = property(lambda self: self.efficiency * Ring.bending_stiffness.fget(self))


class EquivalentStiffnessLining(BeamSpringLining):
    """No joints; staggered segments take M (1 + zeta), and M (1 - zeta) is left for the joints between them."""

    name = "equivalent-stiffness"

    def __init__(self, ring, efficiency, moment_increase=0.0):
        super().__init__(SoftenedRing(**ring.model_dump() | {"joint_angles": (), "efficiency": efficiency}))
        self.moment_increase = moment_increase

    def respond(self, pressures):
        response = super().respond(pressures)
        response["bending_moment"] *= 1 + self.moment_increase
        return response


loads = theory.theoretical_pressures(outer_diameter=6.6, cover=20, buoyant_unit_weight=8.9e3, coefficient_at_rest=0.43)
print(EquivalentStiffnessLining(load_scene("case-3").ring, efficiency=0.7, moment_increase=0.3).respond(loads))
