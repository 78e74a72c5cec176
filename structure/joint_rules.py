"""What the joints of a ring must be: the rules that its validation asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from structure.ring import Ring

#: What may be stated for every joint by its own.
PER_JOINT = (
    "joint_rotational_stiffness", "joint_normal_stiffness", "joint_shear_stiffness", "joint_contact_height",
    "joint_friction_coefficient", "joint_inclinations", "joint_bolts",
)  # fmt: skip
#: [degree]
STEEPEST_JOINT = 45.0


def check_joints(ring: Ring) -> None:
    """Refuse joints that contradict the ring or each other. Raises ValueError: rule, name, value, remedy."""
    _check_angles(ring)
    _check_given(ring)
    _check_sizes(ring)
    if ring.joint_contact == "face":
        _check_face(ring)
    _check_laws(ring)
    if ring.joint_bolts is not None:
        _check_bolts(ring)


def _check_angles(ring):
    for angle in ring.joint_angles:
        if not 0 <= angle < 360:
            raise ValueError(f"joint_angles must lie in [0, 360) degrees, got {angle:g}; add or subtract 360")
    smallest = 2 * 360 / ring.n_elements
    if list(ring.joint_angles) != sorted(ring.joint_angles) or min(ring.segment_angles) < smallest:
        raise ValueError(
            f"joint_angles must increase by at least two elements ({smallest:g} degrees), got {ring.joint_angles};"
            " sort them, or raise n_elements"
        )


def _check_given(ring):
    stiffnesses = {"joint_rotational_stiffness", "joint_normal_stiffness", "joint_shear_stiffness"}
    if ring.joint_contact == "face":
        stiffnesses -= {"joint_rotational_stiffness"}
    missing = sorted(stiffnesses - ring.model_fields_set)
    if ring.joint_angles and missing:
        raise ValueError(f"joints need {', '.join(missing)}, got none; state them, 0 for a free hinge")
    count = len(ring.joint_angles)
    for name in PER_JOINT:
        given = getattr(ring, name)
        if isinstance(given, tuple) and (given or name != "joint_inclinations") and len(given) != count:
            raise ValueError(
                f"{name} must be one for all joints or {count}, one for each, got {len(given)}; give it in the"
                " order of joint_angles"
            )


def _check_sizes(ring):
    height = 0.0 if ring.joint_contact_height is None else ring.contact_heights.max(initial=0.0)
    if height > ring.thickness * (1 + 1e-9):
        raise ValueError(
            f"joint_contact_height must not exceed the thickness {ring.thickness:g} m, got {height:g} m; give the"
            " height over which the segments touch"
        )
    steepest = max(map(abs, ring.joint_inclinations), default=0.0)
    if steepest > STEEPEST_JOINT:
        raise ValueError(
            f"joint_inclinations must lie within {STEEPEST_JOINT:g} degrees of the radius, got {steepest:g}; the"
            " joint of a plane ring stands across the segment"
        )


def _check_face(ring):
    if not ring.joint_angles:
        raise ValueError("joint_contact must be 'section' where there are no joints, got 'face'; leave it out")
    if (ring.per_joint("joint_normal_stiffness") == 0).any():
        raise ValueError(
            "joint_normal_stiffness must be above 0 where joint_contact is 'face', got 0; faces that touch press"
        )
    turning, given = ring.face_turning, ring.per_joint("joint_rotational_stiffness")
    if "joint_rotational_stiffness" in ring.model_fields_set and (np.abs(given - turning) > 0.01 * turning).any():
        worst = int(np.argmax(np.abs(given / turning - 1)))
        raise ValueError(
            f"joint_rotational_stiffness must be k_n h^2/12 = {turning[worst]:.4g} N m/rad where joint_contact is"
            f" 'face', got {given[worst]:.4g} at joint {worst + 1}; leave it out, or give the"
            f" joint_normal_stiffness {12 * given[worst] / ring.contact_heights[worst] ** 2:.4g} N/m that turns so"
        )


def _check_laws(ring):
    needs = {
        "joint_contact_height": ["joint_rotational_stiffness", "joint_normal_stiffness"],
        "joint_friction_coefficient": ["joint_shear_stiffness", "joint_normal_stiffness"],
    }
    if ring.joint_contact == "face":
        needs["joint_contact_height"].remove("joint_rotational_stiffness")
    for name, stiffnesses in needs.items():
        for stiffness in stiffnesses:
            if getattr(ring, name) is not None and (ring.per_joint(stiffness) == 0).any():
                raise ValueError(
                    f"{stiffness} must be above 0 where {name} is given, got 0; this law limits the force of that"
                    f" spring by the axial force in the joint: leave {name} out"
                )


def _check_bolts(ring):
    if not ring.joint_angles:
        raise ValueError("joint_bolts: the ring must have joints, got none; leave bolts out, or give joint_angles")
    for bolts in ring.bolts:
        if not abs(bolts.offset) < ring.thickness / 2:
            raise ValueError(
                f"joint_bolts: offset must lie within half the thickness {ring.thickness / 2:g} m, got"
                f" {bolts.offset:g} m; it counts outward from the centre line"
            )
