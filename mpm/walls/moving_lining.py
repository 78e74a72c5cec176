"""One velocity for a lining that moves and the material that rests on it.

A light or stiff ring under heavy soil is unstable when each is advanced with the other's old state, so both are solved
together: at every contact node the reactions of soil and water follow from the velocity of the wall there (the node
equations of `mpm.walls.contact`, seen from the wall), and the ring's velocity u is the root of
    F(u) = A (u - u0) - dt (weight - K x) + sum over nodes of G^T dt R(G u),   A = M + dt^2/4 K,
with G the velocity of a node per coordinate of the ring. The reactions are piecewise linear in u, so Newton's method
ends after as many iterations as contacts change their state in a step, mostly one. Joints that open, gape or slide add
dt J^T s(J (x + dt u)), J what they feel of the coordinates: with the reactions linearised, all around the
joints is a linear answer to their forces s, between which the ring finds them exactly, however stiff they are. These
act as at the end of the step (Euler backward): in its mean, as all else, joints that close would gain energy. What is
left is taken into the next step: momentum is conserved whatever happens.
"""

from types import SimpleNamespace

import numpy as np

from mpm.fields import values
from mpm.walls.ring_balance import STATE_RECORD, balance_kernel, gather_kernel, ring_impulse, solve_dense
from mpm.walls.rings import ElasticRing, RigidRing, effective_mass

MAX_ITERATIONS = 100
LARGEST_JUMP = 0.1  # of a joint over the outer radius, that is still small
SMALLEST_SHARE = 1e-3  # of Newton's step
TOLERANCE = 1e-11  # of the largest term of an equation: round-off of its sum


def _times(matrix, other):
    """Their product; that of BLAS depends on its number of threads in the last bits."""
    return np.einsum("ij,j...->i...", matrix, other)


class LiningLost(ArithmeticError):
    """A lining of a `tunnel` that can not be followed any further; the message says why."""

    def __init__(self, tunnel, why):
        self.tunnel = tunnel
        super().__init__(why)


class MovingLinings:
    """The linings of a scene that may move, and the velocities of their contact nodes.

    Parameters
    ----------
    scene : mpm.scene.Scene
    needs : mpm.step.system.Needs
    mesh : mpm.mesh.Mesh
    contact_of_node : (n_nodes,) int32
        Row of the contact arrays or -1.
    rows_of_tunnel : list of (k,) int
        Contact rows of every tunnel.

    Attributes
    ----------
    displacement, velocity, left : (m,) float64
        Coordinates of all rings [m], their rates [m/s], and impulses taken into the next step [N s/m].
    memory : (n,) float64
        What joints that are not linear remember.
    wall : (n_contact, 2) float64
        Velocity of the lining at its contact nodes [m/s], of the step at hand.
    """

    def __init__(self, scene, needs, mesh, contact_of_node, rows_of_tunnel):
        on_lining = np.flatnonzero(contact_of_node >= 0)
        self.node_of_contact = np.zeros(len(on_lining), np.int32)
        self.node_of_contact[contact_of_node[on_lining]] = on_lining
        self._gather, self._find_balance = gather_kernel(needs), balance_kernel(needs.wet)
        self._find_dry_balance = balance_kernel(False)
        self.wall = np.zeros((len(on_lining), 2))
        self.parts = []
        rings = [(t, ring) for t, ring in enumerate(lining_ring(scene, tunnel) for tunnel in scene.tunnels) if ring]
        ends = np.cumsum([0, *(len(ring.weight) for _, ring in rings)])
        self.displacement, self.velocity, self.left = (np.zeros(ends[-1]) for _ in range(3))
        moves = [getattr(ring, "moves", np.zeros((0, len(ring.weight)))) for _, ring in rings]
        pairs = zip(rings, moves, strict=True)
        joints = np.cumsum([0, *(len(ring.jumps) if felt.size else 0 for (_, ring), felt in pairs)])
        self.memory = np.zeros(joints[-1])
        for (t, ring), felt, first, last, *joint in zip(rings, moves, ends, ends[1:], joints, joints[1:], strict=False):
            rows, tunnel = np.asarray(rows_of_tunnel[t]), scene.tunnels[t]
            x, y = (mesh.nodes[self.node_of_contact[rows]] - [tunnel.x, -tunnel.axis_depth]).T
            theta, radius = np.arctan2(x, y), np.hypot(x, y)
            self.parts.append(
                SimpleNamespace(
                    tunnel=t,
                    ring=ring,
                    rows=rows,
                    motion=ring.motion(theta, radius),
                    moves=felt,
                    state=np.zeros(len(rows), STATE_RECORD),
                    due=np.zeros(last - first),
                    memory=self.memory[slice(*joint)],
                    **{name: getattr(self, name)[first:last] for name in ("displacement", "velocity", "left")},
                )
            )

    def advance(self, system, dt):
        """Move the rings by dt [s] together with the material at their nodes; sets `wall`.

        system : mpm.step.system.System, whose nodal sums are those of the points as they are.
        """
        for part in self.parts:
            ring = part.ring
            self._gather(system, dt, part.rows, self.node_of_contact, part.state)
            ring_impulse(ring.stiffness, ring.weight, part.displacement, dt, part.due)
            mass = effective_mass(ring, dt)
            self._solve(self._find_balance, part, system.walls.contact, mass, dt)
            part.displacement += dt * part.velocity

    def _solve(self, find_balance, part, contact, mass, dt):
        """The ring's velocity, that of the wall, and what joints remember; these act as at the end of the step."""
        before = part.velocity.copy()
        given = part.state, part.rows, part.motion, contact, mass, np.stack([part.left, part.due]), before
        balance, matrix = np.empty((2, len(before))), np.empty_like(mass)
        found, force, remembered, least = before, np.zeros(len(part.moves)), part.memory, np.inf
        for _ in range(MAX_ITERATIONS):
            place, last = found, force
            find_balance(*given, place, self.wall, balance, matrix)
            right = np.vstack([balance[:1], part.moves]).T.copy()
            solve_dense(matrix, right)
            found, force, remembered = self._with_joints(part, dt, place, place - right[:, 0], right[:, 1:])
            to, of, part_way = found, force, 1.0
            while True:
                find_balance(*given, found, self.wall, balance, matrix[:0])
                if force.size:
                    of_joints = dt * part.moves * force[:, None]
                    balance += of_joints.sum(axis=0), np.abs(of_joints).sum(axis=0)
                missed = np.sum(balance[0] ** 2)
                if missed < least or part_way < SMALLEST_SHARE:
                    break
                # contacts that change back and forth, as between sticking and slipping: half the way
                part_way *= 0.5
                found, force = place + part_way * (to - place), last + part_way * (of - last)
            least = missed
            if part_way == 1.0 and np.all(np.abs(balance[0]) <= TOLERANCE * balance[1]):
                break
        part.velocity[:], part.left[:], part.memory[:] = found, balance[0], remembered

    @staticmethod
    def _with_joints(part, dt, place, free, answers):
        """Velocity of a ring with its joints, their forces, what they remember; `answers` (m, n) of it to these forces.

        place, free : (m,) float64, velocities at hand and without the joints.
        """
        moves = part.moves
        if not moves.size:
            return free, np.zeros(0), part.memory
        flexibility = dt**2 * _times(moves, answers)
        apart, near = (_times(moves, part.displacement + dt * velocity) for velocity in (free, place))
        try:
            force, remembered = part.ring.joints_between(flexibility, apart, near, part.memory)
        except ArithmeticError as problem:
            raise LiningLost(
                part.tunnel,
                f"the joints of tunnel {part.tunnel} found no equilibrium with their ring and the ground: lower "
                "ring.joint_rotational_stiffness, or leave joint_contact_height out",
            ) from problem
        return free - dt * _times(answers, force), force, remembered

    def settle(self, force, held_liquid, mass, velocity, contact):
        """One pseudo time step of 1 s of the drained relaxation (`mpm.relaxation`): moves the rings, sets `wall`.

        The inertia of a ring is fictitious as the soil's, as large as that of its contact nodes; its stiffness acts at
        the end of the step (Euler backward), so stiff motions settle at once. It goes where its velocity takes it when
        the ground does, at the beginning of the next step: where both are brought to rest neither gets there.

        Parameters
        ----------
        force, held_liquid, velocity : (n_nodes, 2) float64
            Of the mixture and of the water [N/m]; of the nodes [m/s].
        mass : (n_nodes,) float64
            Fictitious masses of the nodes.

        Returns
        -------
        energy, unbalanced : float
            Kinetic energy and squared unbalanced force of the rings.
        """
        energy = unbalanced = 0.0
        for part in self.parts:
            ring, rows = part.ring, part.rows
            nodes, n = self.node_of_contact[rows], values(contact[rows], ("normal_x", "normal_y"))
            pressed = np.maximum(-np.sum(n * held_liquid[nodes], axis=1), 0.0)
            water = np.where(contact["active"][rows] > 0, pressed, 0.0)
            part.state["solid"] = mass[nodes]
            free = mass[nodes, None] * velocity[nodes] + force[nodes] + water[:, None] * n
            part.state["momentum_solid_x"], part.state["momentum_solid_y"] = free.T
            ring_mass = ring.mass * (mass[nodes].sum() / ring.mass.diagonal().max())
            before = part.velocity.copy()
            part.displacement += before
            ring_impulse(ring.stiffness, ring.weight, part.displacement + before, 1.0, part.due)
            part.due -= np.einsum("kdm,kd,k->m", part.motion, n, water)
            remembered = part.memory.copy()
            self._solve(self._find_dry_balance, part, contact, ring_mass + ring.stiffness, 1.0)
            part.memory[:] = remembered
            momentum = np.einsum("ij,j->i", ring_mass, part.velocity)
            energy += float(np.sum(part.velocity * momentum))
            unbalanced += float(np.sum(np.einsum("ij,j->i", ring_mass, part.velocity - before) ** 2))
        return energy, unbalanced

    def check(self):
        """Raise LiningLost where joints move so far that displacements are not small any more."""
        for part in self.parts:
            radius = part.ring.outer_radius
            jumps = getattr(part.ring, "jumps", np.zeros((0, 3, len(part.displacement)))) @ part.displacement
            moved, most = np.abs(jumps * [1.0, 1.0, radius]).max(initial=0.0), LARGEST_JUMP * radius
            if not moved <= most:
                raise LiningLost(
                    part.tunnel,
                    f"a joint of tunnel {part.tunnel} opens, slides or turns by {moved:.3g} m, beyond {most:.3g} m (a "
                    "tenth of the outer radius), where displacements are no longer small: raise the stiffness or the "
                    "friction of the joints in [ring], or choose lining = 'elastic'",
                )

    def halt(self):
        """Bring the rings to rest where they are."""
        self.velocity[:] = 0.0
        self.left[:] = 0.0

    def remember(self):
        """Let the joints remember where they are: in the initial state as if they had gone there straight."""
        for part in self.parts:
            if part.moves.size:
                part.memory[:] = part.ring.joint_forces(part.moves @ part.displacement, part.memory)[2]

    def motion_at(self, tunnel, theta):
        """Displacement of the outer face, and the forces of an elastic ring, at theta [degrees].

        Returns
        -------
        dict of str to (n,) float64
            displacement_radial, displacement_tangential [m], outward and clockwise; of a ring that deforms axial_force,
            shear_force [N/m], bending_moment [N m/m]; (n_joints,) of a jointed one what its `joints` gives. Zero and
            empty for a fixed lining.
        """
        part = next((part for part in self.parts if part.tunnel == tunnel), None)
        a = np.radians(theta)
        if part is None:
            return {"displacement_radial": 0.0 * a, "displacement_tangential": 0.0 * a}
        outer = part.ring.outer_radius
        x, y = np.einsum("kdm,m->dk", part.ring.motion(a, outer), part.displacement)
        result = {
            "displacement_radial": x * np.sin(a) + y * np.cos(a),
            "displacement_tangential": x * np.cos(a) - y * np.sin(a),
        }
        if hasattr(part.ring, "internal_forces"):
            forces = part.ring.internal_forces(part.displacement, a)
            result |= dict(zip(("axial_force", "shear_force", "bending_moment"), forces, strict=True))
        if hasattr(part.ring, "joints"):
            result |= part.ring.joints(part.displacement, part.memory)
        return result


def lining_ring(scene, tunnel):
    """The ring that moves as a tunnel's lining, or None where it is fixed."""
    geometry = tunnel.outer_radius, tunnel.inner_radius, tunnel.lining_density, scene.gravity
    kind = scene.lining_of(tunnel)
    if kind == "jointed":
        return scene.jointed_ring(tunnel)
    if kind == "elastic":
        return ElasticRing.build(
            *geometry, tunnel.lining_modulus, tunnel.lining_poissons_ratio, tunnel.lining_harmonics
        )
    return RigidRing.build(*geometry) if kind == "floating" else None
