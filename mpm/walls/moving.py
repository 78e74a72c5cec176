"""One velocity for a lining that moves and the material that rests on it.

A light or stiff ring under heavy soil is unstable when each is advanced with the other's old state, so both are solved
together: at every contact node the reactions of soil and water follow from the velocity of the wall there (the node
equations of `mpm.walls.contact`, seen from the wall), and the ring's velocity u is the root of
    F(u) = A (u - u0) - dt (weight - K x) + sum over nodes of G^T dt R(G u),   A = M + dt^2/4 K,
with G the velocity of a node per coordinate of the ring. The reactions are piecewise linear in u, so Newton's method
ends after as many iterations as contacts change their state in a step, mostly one. Joints that open, gape or slide add
s(x + dt/4 (u - u0)) dt, which is linearised around the last solution until that is exact. What is left is taken into
the next step: momentum is conserved whatever happens.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np

from mpm.fields import record, values
from mpm.machine.compile import kernel, kernel_part
from mpm.step.nodes import free_kernel, moved, sum_kernel, velocities_of
from mpm.walls.contact import Masses, Pair, response_kernel
from mpm.walls.rings import BETA, ElasticRing, RigidRing, effective_mass

MAX_ITERATIONS = 100
MAX_JOINT_ITERATIONS = 50
MOST_MISSED = 1e-3  # of the force of joints at which a step may end, for the next one to make up
ROUNDINGS = 16  # of the largest term of a joint's force, that no residual gets below
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
    """Solve matrix x = right by elimination with partial pivoting, in place; the solution replaces `right`.

    LAPACK's bits may depend on its threads.
    """
    n = right.size
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


@cache
def node_kernel(wet):
    """Kernel `add_node` for soil with pore water or without."""
    react = reaction_kernel(wet)

    @kernel_part
    def add_node(node, c, g, contact, velocity, wall, along, across, matrix, residual, scale):
        """Add the reaction of a node to the ring's balance, its derivatives and its size; set the wall's velocity.

        node : record of `gather`;  c : row of `contact` and `wall`;  g : (2, m) float64 of `motion`
        along, across : (m,) float64, scratch.
        """
        m = velocity.size
        ux = uy = 0.0
        for j in range(m):
            ux += g[0, j] * velocity[j]
            uy += g[1, j] * velocity[j]
        wall[c, 0], wall[c, 1] = ux, uy
        if contact[c].active <= 0.0 or node.solid <= 0.0:
            return
        nx, ny = contact[c].normal_x, contact[c].normal_y
        push, shear, push_n, shear_n, shear_t = react(node, contact[c], ux, uy)
        if push == 0.0:
            return
        for j in range(m):
            along[j], across[j] = nx * g[0, j] + ny * g[1, j], ny * g[0, j] - nx * g[1, j]
        for i in range(m):
            felt = along[i] * push + across[i] * shear
            residual[i] += felt
            scale[i] += abs(felt)
            by_n, by_t = along[i] * push_n + across[i] * shear_n, across[i] * shear_t
            for j in range(m):
                matrix[i, j] += by_n * along[j] + by_t * across[j]

    return add_node


@cache
def velocity_kernel(wet):
    """Kernel `find_velocity` for soil with pore water or without."""
    add_node = node_kernel(wet)

    @kernel
    def find_velocity(state, rows, motion, contact, effective_mass, due, velocity, left, wall):
        """Velocity of the ring and of the wall at its nodes, in place, by Newton's method.

        Parameters
        ----------
        state : (k,) records
            Of `gather`.
        rows : (k,) int
            Rows of `contact` and `wall`.
        motion : (k, 2, m) float64
            Velocity of the nodes per coordinate.
        effective_mass, due : (m, m), (m,) float64
            A [kg/m] and the impulse on the ring without reactions [N s/m].
        velocity, left : (m,) float64
            u [m/s]; the impulse that earlier steps left, then that of this one [N s/m].
        wall : (n_contact, 2) float64
            Written at `rows` [m/s].

        Returns
        -------
        iterations : int
        """
        m = velocity.size
        before, owed = velocity.copy(), left.copy()
        matrix, residual, scale = np.empty((m, m)), np.empty(m), np.empty(m)
        along, across, change = np.empty(m), np.empty(m), np.zeros(m)
        iterations, share, smallest = 0, 1.0, np.inf
        while True:
            for i in range(m):
                residual[i] = owed[i] - due[i]
                scale[i] = abs(owed[i]) + abs(due[i])
                for j in range(m):
                    matrix[i, j] = effective_mass[i, j]
                    moved = effective_mass[i, j] * (velocity[j] - before[j])
                    residual[i] += moved
                    scale[i] += abs(moved)
            for k in range(rows.size):
                add_node(state[k], rows[k], motion[k], contact, velocity, wall, along, across, matrix, residual, scale)
            error = size = 0.0
            for i in range(m):
                size += residual[i] ** 2
                if scale[i] > 0.0:
                    error = max(error, abs(residual[i]) / scale[i])
            if error < TOLERANCE or iterations == MAX_ITERATIONS:
                break
            iterations += 1
            if size >= smallest and share > SMALLEST_SHARE:
                # contacts that change back and forth, as between sticking and slipping: half the way
                share *= 0.5
                for i in range(m):
                    velocity[i] += share * change[i]
                continue
            smallest, share = size, 1.0
            change[:] = residual
            solve_dense(matrix, change)
            for i in range(m):
                velocity[i] -= change[i]
        left[:] = residual
        return iterations

    return find_velocity


@kernel
def ring_impulse(stiffness, weight, displacement, dt, due):
    """dt (weight - K x), written to `due` (m,) [N s/m]."""
    for i in range(due.size):
        force = weight[i]
        for j in range(due.size):
            force -= stiffness[i, j] * displacement[j]
        due[i] = dt * force


class NoJointEquilibrium(ArithmeticError):
    """Joints whose forces could not be found in a step, of a `tunnel`."""

    def __init__(self, tunnel):
        self.tunnel = tunnel
        super().__init__(
            f"the joints of tunnel {tunnel} found no equilibrium with their ring and the ground: lower "
            "ring.joint_rotational_stiffness, or leave joint_contact_height out"
        )


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
        self._gather, self._find = gather_kernel(needs), velocity_kernel(needs.wet)
        self._find_dry = velocity_kernel(False)
        self.wall = np.zeros((len(on_lining), 2))
        self.parts = []
        rings = [(t, ring) for t, ring in enumerate(lining_ring(scene, tunnel) for tunnel in scene.tunnels) if ring]
        ends = np.cumsum([0, *(len(ring.weight) for _, ring in rings)])
        self.displacement, self.velocity, self.left = (np.zeros(ends[-1]) for _ in range(3))
        joints = np.cumsum([0, *(0 if ring.joints_linear else len(ring.jumps) for _, ring in rings)])
        self.memory = np.zeros(joints[-1])
        for (t, ring), first, last, *joint in zip(rings, ends, ends[1:], joints, joints[1:], strict=False):
            rows, tunnel = np.asarray(rows_of_tunnel[t]), scene.tunnels[t]
            x, y = (mesh.nodes[self.node_of_contact[rows]] - [tunnel.x, -tunnel.axis_depth]).T
            theta, radius = np.arctan2(x, y), np.hypot(x, y)
            self.parts.append(
                SimpleNamespace(
                    tunnel=t,
                    ring=ring,
                    rows=rows,
                    motion=ring.motion(theta, radius),
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
            self._solve(self._find, part, system.walls.contact, mass, dt, part.displacement, BETA * dt)
            part.displacement += dt * part.velocity

    def _solve(self, find, part, contact, mass, dt, start, share):
        """The ring's velocity; forces of joints that are not linear, of the place `start` + `share` times its change,
        are linearised where they were found last, halfway back where they miss by more than before.
        """
        ring, velocity, left = part.ring, part.velocity, part.left
        if ring.joints_linear:
            find(part.state, part.rows, part.motion, contact, mass, part.due, velocity, left, self.wall)
            return
        before, owed, place = velocity.copy(), left.copy(), start
        force, tangent, remembered = ring.joint_forces(place, part.memory)
        least = np.inf
        for _ in range(MAX_JOINT_ITERATIONS):
            due = part.due - dt * (force - tangent @ (place - start))
            velocity[:], left[:] = before, owed
            find(
                part.state, part.rows, part.motion, contact, mass + dt * share * tangent, due, velocity, left,
                self.wall,
            )  # fmt: skip
            found = start + share * (velocity - before)
            expected, size = force + tangent @ (found - place), np.abs(force) + np.abs(tangent) @ np.abs(place)
            actual, slope, remembered = ring.joint_forces(found, part.memory)
            missed = actual - expected
            if np.all(np.abs(missed) <= ROUNDINGS * np.finfo(float).eps * size):
                break
            miss = np.linalg.norm(missed)
            if miss < least:
                least, place, force, tangent = miss, found, actual, slope
            else:
                place = 0.5 * (place + found)
                force, tangent, _ = ring.joint_forces(place, part.memory)
        else:
            if not np.linalg.norm(missed) <= MOST_MISSED * np.linalg.norm(actual):
                raise NoJointEquilibrium(part.tunnel)
        left += dt * missed
        part.memory[:] = remembered

    def settle(self, force, held_liquid, mass, velocity, contact):
        """One pseudo time step of 1 s of the drained relaxation (`mpm.relaxation`): moves the rings, sets `wall`.

        The inertia of a ring is fictitious as the soil's, as large as that of its contact nodes; its stiffness acts at
        the end of the step (Euler backward), so stiff motions settle at once.

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
            ring_impulse(ring.stiffness, ring.weight, part.displacement + before, 1.0, part.due)
            part.due -= np.einsum("kdm,kd,k->m", part.motion, n, water)
            remembered = part.memory.copy()
            self._solve(self._find_dry, part, contact, ring_mass + ring.stiffness, 1.0, part.displacement + before, 1.0)
            part.memory[:] = remembered
            part.displacement += part.velocity
            momentum = np.einsum("ij,j->i", ring_mass, part.velocity)
            energy += float(np.sum(part.velocity * momentum))
            unbalanced += float(np.sum(np.einsum("ij,j->i", ring_mass, part.velocity - before) ** 2))
        return energy, unbalanced

    def halt(self):
        """Bring the rings to rest where they are."""
        self.velocity[:] = 0.0
        self.left[:] = 0.0

    def remember(self):
        """Let the joints remember where they are: in the initial state as if they had gone there straight."""
        for part in self.parts:
            if not part.ring.joints_linear:
                part.memory[:] = part.ring.joint_forces(part.displacement, part.memory)[2]

    def motion_at(self, tunnel, theta):
        """Displacement of the outer face, and the forces of an elastic ring, at theta [degrees].

        Returns
        -------
        dict of str to (n,) float64
            displacement_radial, displacement_tangential [m], outward and clockwise; of a ring that deforms axial_force,
            shear_force [N/m], bending_moment [N m/m]; (n_joints,) of a jointed one joint_opening, joint_dislocation
            [m], joint_rotation [rad]. Zero and empty for a fixed lining.
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
        if hasattr(part.ring, "jumps"):
            moved = part.ring.jumps @ part.displacement
            result |= dict(zip(("joint_opening", "joint_dislocation", "joint_rotation"), moved.T, strict=True))
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
