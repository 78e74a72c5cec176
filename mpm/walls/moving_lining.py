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

from functools import cache
from types import SimpleNamespace

import numpy as np

from mpm.fields import record, values
from mpm.machine.compile import kernel, kernel_part
from mpm.step.nodes import free_kernel, moved, sum_kernel, velocities_of
from mpm.walls.contact import Masses, Pair, response_kernel
from mpm.walls.rings import ElasticRing, RigidRing, effective_mass

MAX_ITERATIONS = 100
LARGEST_JUMP = 0.1  # of a joint over the outer radius, that is still small
SMALLEST_SHARE = 1e-3  # of Newton's step
TOLERANCE = 1e-11  # of the largest term of an equation: round-off of its sum

#: What a contact node brings to the solution: masses, drag times dt, momenta free of reactions.
STATE_RECORD = record(
    ("solid", "liquid", "pore", "drag", "momentum_solid_x", "momentum_solid_y", "momentum_liquid_x",
     "momentum_liquid_y")
)  # fmt: skip


@cache
def gather_kernel(needs):
    """Kernel `gather` for what a scene needs."""
    two_phase, sum_of_node, without_reactions = needs.two_phase, sum_kernel(needs), free_kernel(needs)

    @kernel
    def gather(system, dt, rows, node_of_contact, state):
        """Masses and momenta of the contact nodes `rows` at the end of a step without reactions.

        rows, node_of_contact : (k,), (n_contact,) int
        state : (k,) records, written.
        """
        gravity = system.medium.gravity
        for k in range(rows.size):
            row = state[k]
            m, p, force = sum_of_node(node_of_contact[rows[k]], dt, system.net, system.walls)
            row.solid, row.liquid, row.pore, row.drag = m
            if m.solid <= 0.0 or (two_phase and m.liquid <= 0.0):
                row.solid = 0.0
                continue
            b = without_reactions(m, p, velocities_of(m, p, two_phase), force, dt, gravity)
            row.momentum_solid_x, row.momentum_solid_y, row.momentum_liquid_x, row.momentum_liquid_y = b

    return gather


@cache
def reaction_kernel(wet):
    """Kernel `react` for soil with pore water or without."""
    response = response_kernel(wet)

    @kernel_part
    def react(row, contact, x, y):
        """Impulse that a wall that moves with (x, y) [m/s] gives to a node, and its derivatives: see `response`.

        row : record of `gather`;  contact : record of the wall there.
        """
        m = Masses(row.solid, row.liquid, row.pore, row.drag)
        b = Pair(row.momentum_solid_x, row.momentum_solid_y, row.momentum_liquid_x, row.momentum_liquid_y)
        return response(moved(b, m, x, y), m, contact)

    return react


@kernel
def solve_dense(matrix, right):
    """Solve matrix x = right, (m, m) and (m, n), by elimination with partial pivoting, in place; the solutions replace
    `right`.

    LAPACK's bits may depend on its threads.
    """
    n, columns = right.shape
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(columns):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(columns):
                    right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            for j in range(columns):
                right[k, j] -= matrix[k, i] * right[i, j]
        for j in range(columns):
            right[k, j] /= matrix[k, k]


@cache
def balance_kernel(wet):
    """Kernel `find_balance` for soil with pore water or without."""
    react = reaction_kernel(wet)

    @kernel
    def find_balance(state, rows, motion, contact, mass, impulse, before, velocity, wall, balance, matrix):
        """Sum of all impulses on a ring, but of joints, that would give it a velocity, and its derivatives.

        Parameters
        ----------
        state : (k,) records
            Of `gather`.
        rows : (k,) int
            Rows of `contact` and `wall`.
        motion : (k, 2, m) float64
            Velocity of the nodes per coordinate.
        mass : (m, m) float64
            [kg/m]
        impulse : (2, m) float64
            What is left of earlier steps, and without reactions [N s/m].
        before, velocity : (m,) float64
            [m/s]
        wall : (n_contact, 2) float64
            Velocity there, written at `rows` [m/s].
        balance : (2, m) float64
            Written: the sum, which should be zero, and that of the sizes [N s/m].
        matrix : (m, m) float64
            Written: derivatives of the sum [kg/m]; nothing where it is empty.
        """
        m = velocity.size
        along, across = np.empty(m), np.empty(m)
        for i in range(m):
            balance[0, i] = impulse[0, i] - impulse[1, i]
            balance[1, i] = abs(impulse[0, i]) + abs(impulse[1, i])
            for j in range(m):
                moved = mass[i, j] * (velocity[j] - before[j])
                balance[0, i] += moved
                balance[1, i] += abs(moved)
        if matrix.size > 0:
            matrix[:] = mass
        for k in range(rows.size):
            c, g = rows[k], motion[k]
            ux = uy = 0.0
            for j in range(m):
                ux += g[0, j] * velocity[j]
                uy += g[1, j] * velocity[j]
            wall[c, 0], wall[c, 1] = ux, uy
            if contact[c].active <= 0.0 or state[k].solid <= 0.0:
                continue
            push, shear, push_n, shear_n, shear_t = react(state[k], contact[c], ux, uy)
            if push == 0.0:
                continue
            nx, ny = contact[c].normal_x, contact[c].normal_y
            for j in range(m):
                along[j], across[j] = nx * g[0, j] + ny * g[1, j], ny * g[0, j] - nx * g[1, j]
                felt = along[j] * push + across[j] * shear
                balance[0, j] += felt
                balance[1, j] += abs(felt)
            if matrix.size == 0:
                continue
            for i in range(m):
                by_n, by_t = along[i] * push_n + across[i] * shear_n, across[i] * shear_t
                for j in range(m):
                    matrix[i, j] += by_n * along[j] + by_t * across[j]

    return find_balance


def _times(matrix, other):
    """Their product; that of BLAS depends on its number of threads in the last bits."""
    return np.einsum("ij,j...->i...", matrix, other)


@kernel
def ring_impulse(stiffness, weight, displacement, dt, due):
    """dt (weight - K x), written to `due` (m,) [N s/m]."""
    for i in range(due.size):
        force = weight[i]
        for j in range(due.size):
            force -= stiffness[i, j] * displacement[j]
        due[i] = dt * force


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
