"""The ring once more, in OpenSees: reads a ring from standard input as JSON, writes its response to standard output.

A program of its own, so that OpenSees' libraries (an OpenMP runtime among them), its messages and its crashes stay out
of the process that tests. Built from OpenSees' elements and materials; only node places and nodal loads come from
outside. Node i of the ring is OpenSees' node i + 1; x to the right, y up, rotation counter-clockwise.
"""

import json
import math
import sys

import openseespy.opensees as ops

FACE, GROUND = 100_000, 200_000


def build(ring):
    """Beams, joints, soil springs and loads; returns the tags of the joints."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for node, angle in enumerate(ring["node_angle"], 1):
        ops.node(node, ring["radius"] * math.sin(angle), ring["radius"] * math.cos(angle))
    ops.geomTransf("Linear", 1)
    for tag, (first, second) in enumerate(ring["elements"], 1):
        modulus, area, second_moment = ring["youngs_modulus"], ring["area"], ring["second_moment"]
        if ring["shear_area"]:
            ops.element("elasticTimoshenkoBeam", tag, first + 1, second + 1, modulus, ring["shear_modulus"], area,
                        second_moment, ring["shear_area"], 1)  # fmt: skip
        else:
            ops.element("elasticBeamColumn", tag, first + 1, second + 1, area, modulus, second_moment, 1)
    joints = join(ring)
    if ring["soil"]:
        embed(ring)
    for node in ring["clamped"]:
        ops.fix(node + 1, 1, 1, 1)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, (angle, (outward, clockwise, couple)) in enumerate(
        zip(ring["node_angle"], ring["loads"], strict=True), 1
    ):
        sine, cosine = math.sin(angle), math.cos(angle)
        ops.load(node, outward * sine + clockwise * cosine, outward * cosine - clockwise * sine, -couple)
    return joints


def join(ring):
    """Zero-length springs along and across the centre line, and a rotational one, linear or through given points."""
    material, tags = 1, []
    for number, joint in enumerate(ring["joints"]):
        springs = []
        ops.uniaxialMaterial("Elastic", material, joint["normal"])
        if "yield" in joint:
            ops.uniaxialMaterial("ElasticPP", material + 1, joint["shear"], joint["yield"] / joint["shear"])
        else:
            ops.uniaxialMaterial("Elastic", material + 1, joint["shear"])
        springs += [material, material + 1]
        material += 2
        if "moment" in joint:
            rotation, moment = joint["rotation"], joint["moment"]
            strain = [-value for value in reversed(rotation)] + [0.0] + rotation
            stress = [-value for value in reversed(moment)] + [0.0] + moment
            ops.uniaxialMaterial("ElasticMultiLinear", material, "-strain", *strain, "-stress", *stress)
        else:
            ops.uniaxialMaterial("Elastic", material, joint["rotational"])
        springs.append(material)
        material += 1
        tags.append(10_000 + number)
        sine, cosine = math.sin(joint["angle"]), math.cos(joint["angle"])
        ops.element("zeroLength", tags[-1], joint["before"] + 1, joint["after"] + 1, "-mat", *springs, "-dir", 1, 2, 6,
                    "-orient", cosine, -sine, 0.0, sine, cosine, 0.0)  # fmt: skip
    return tags


def embed(ring):
    """A spring against moving outward and one against sliding, at every node, per area of the outer face."""
    soil, material, tag = ring["soil"], 50_000, 50_000
    for node, (angle, area) in enumerate(zip(ring["node_angle"], ring["node_area"], strict=True), 1):
        sine, cosine = math.sin(angle), math.cos(angle)
        place = (ring["radius"] + soil["lever"]) * sine, (ring["radius"] + soil["lever"]) * cosine
        ops.node(GROUND + node, *place)
        ops.fix(GROUND + node, 1, 1, 1)
        held = node
        if soil["lever"]:
            held = FACE + node
            ops.node(held, *place)
            ops.rigidLink("beam", node, held)
        outward, clockwise = (sine, cosine, 0.0, -cosine, sine, 0.0), (cosine, -sine, 0.0, sine, cosine, 0.0)
        ways = [("normal", outward, (held, GROUND + node)), ("tangential", clockwise, (held, GROUND + node))]
        if soil["law"] == "hyperbolic":
            # only pressing: a second one the other way round holds the other way
            ways.append(("tangential", clockwise, (GROUND + node, held)))
        for way, direction, ends in ways:
            stiffness, limit = soil[way]["stiffness"] * area, soil[way]["limit"]
            if stiffness == 0:
                continue
            if soil["law"] == "hyperbolic":
                ops.uniaxialMaterial("HyperbolicGapMaterial", material, stiffness, stiffness, 1.0, -limit * area, 0.0)
            elif way == "normal" and not soil["two_way"]:
                ops.uniaxialMaterial("ENT", material, stiffness)
            else:
                ops.uniaxialMaterial("Elastic", material, stiffness)
            ops.element("zeroLength", tag, *ends, "-mat", material, "-dir", 1, "-orient", *direction)
            material, tag = material + 1, tag + 1


def solve():
    """One load step by Newton's method, to displacements that no longer change."""
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-13, 200)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    return ops.analyze(1)


def response(ring, joints):
    """Nodal displacements and the forces of beams and joints, in the signs of the lining models."""
    displacement = []
    for node, angle in enumerate(ring["node_angle"], 1):
        right, up, turn = (ops.nodeDisp(node, way) for way in (1, 2, 3))
        sine, cosine = math.sin(angle), math.cos(angle)
        displacement.append([right * sine + up * cosine, right * cosine - up * sine, -turn])
    forces = []
    for tag in range(1, len(ring["elements"]) + 1):
        axial, shear, first, _, _, second = ops.eleResponse(tag, "localForce")
        forces.append([axial, shear, (first - second) / 2])
    jumps = []
    for tag in joints:
        along, across, turn = ops.eleResponse(tag, "deformation")
        jumps.append([along, -across, -turn])
    joint_forces = []
    for tag in joints:
        along, across, turn = ops.eleResponse(tag, "basicForce")
        joint_forces.append([-along, -across, -turn])
    return {"displacement": displacement, "forces": forces, "jumps": jumps, "joint_forces": joint_forces}


if __name__ == "__main__":
    given = json.load(sys.stdin)
    tags = build(given)
    failed = solve()
    result = {"failed": failed, "version": ops.version(), **response(given, tags)}
    print("RESULT " + json.dumps(result))
