"""Bolts across the joints of a ring: what is stated of them, and their law."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from structure.inputs import Input
from structure.joint_contact import TANGENT_FLOOR

if TYPE_CHECKING:
    from structure.ring import Ring


class Bolts(Input):
    """Straight bolts across a joint, square to it, besides the joint's own springs; they pull and never press.

    Their force per metre of tunnel is max(0, preload + stiffness (elongation - slack)). A preload presses the segments
    together before any load: the undeformed ring is that before the bolts are tightened.

    Parameters
    ----------
    offset : float
        Where they cross the joint, outward from the centre line [m].
    length : float
        Between their anchors [m]. The beams see the bolts in the section of the joint; the continuum anchors them in
        the concrete.
    stiffness : float
        EA/length of all of them [N/m per metre of tunnel]; 0 for a joint without.
    slack : float
        Elongation before they begin to pull [m].
    preload : float
        Force to which they were tightened [N per metre of tunnel]; without slack.
    """

    offset: float
    length: float = Field(gt=0)
    stiffness: float = Field(ge=0)
    slack: float = Field(default=0.0, ge=0)
    preload: float = Field(default=0.0, ge=0)

    @model_validator(mode="after")
    def _check(self) -> Bolts:
        if self.slack and self.preload:
            raise ValueError(
                f"slack must be 0 where there is a preload of {self.preload:g} N/m, got {self.slack:g} m; bolts that"
                " are tightened have none"
            )
        return self


class BoltLaw(NamedTuple):
    """Bolts across the joints, as of :class:`Bolts`: they pull once their slack is used up.

    stiffness [N/m2], slack [m], preload [N/m] : (n_joints,) float64 each.
    """

    stiffness: np.ndarray
    slack: np.ndarray
    preload: np.ndarray

    def pull(self, elongation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force [N/m] and its derivative [N/m2] at elongations (..., n_joints) [m]."""
        force = self.preload + self.stiffness * (elongation - self.slack)
        return np.maximum(force, 0.0), np.where(force > 0, self.stiffness, TANGENT_FLOOR * self.stiffness)

    def between(self, both: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Elongations (n_joints,) [m] at which pull plus `stiffness` times elongation is `both`."""
        loose = both / stiffness
        pulls = self.preload + self.stiffness * (loose - self.slack) > 0
        tight = (both - self.preload + self.stiffness * self.slack) / (self.stiffness + stiffness)
        return np.where(pulls, tight, loose)


def bolt_law(ring: Ring) -> BoltLaw:
    """That of the bolts of a ring, of none where it has none."""
    stated = [(bolts.stiffness, bolts.slack, bolts.preload) for bolts in ring.bolts]
    return BoltLaw(*np.reshape(stated, (-1, 3)).T)
