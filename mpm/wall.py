"""One velocity for a lining that moves and the material that rests on it.

A light or stiff ring under heavy soil is unstable when each is advanced with the other's old state, so both are solved
together: at every contact node the reactions of soil and water follow from the velocity of the wall there (the node
equations of `mpm.contact`, seen from the wall), and the ring's velocity u is the root of
    F(u) = A (u - u0) - dt (weight - K x) + sum over nodes of G^T dt R(G u),   A = M + dt^2/4 K,
with G the velocity of a node per coordinate of the ring. The reactions are piecewise linear in u, so Newton's method
ends after as many iterations as contacts change their state in a step, mostly one. What it leaves is taken into the
next step: momentum is conserved whatever happens.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np

from mpm.contact import wall_normal
from mpm.jit import kernel
from mpm.lining import ElasticRing, RigidRing
from mpm.variables import B_D, B_FLX, B_FLY, B_FX, B_FY, B_ML, B_MN, B_MS, B_PLX, B_PLY, B_PSX, B_PSY

MAX_ITERATIONS = 100
SMALLEST_SHARE = 1e-3  # of Newton's step
TOLERANCE = 1e-11  # of the largest term of an equation: round-off of its sum

# What a contact node brings to the solution: masses, drag times dt, momenta free of reactions; and of its reactions.
(K_MS, K_ML, K_MN, K_D, K_BSX, K_BSY, K_BLX, K_BLY) = range(8)
NODE_STATE = 8


@cache
def gather_kernel(wet):
    """Kernel `gather` for soil with pore water or without."""

    @kernel
    def gather(sums, dt, gravity, rows, node_of_contact, state):
        """Masses and momenta of the contact nodes `rows` at the end of a step without reactions.

        sums : (n_parts, n_nodes, 13) float64, of `update_points`.
        rows, node_of_contact : (k,), (n_contact,) int
        state : (k, 8) float64, written.
        """
        for k in range(rows.size):
            i = node_of_contact[rows[k]]
            b = np.zeros(sums.shape[2])
            for part in range(sums.shape[0]):
                b += sums[part, i]
            row = state[k]
            row[:] = 0.0
            ms, ml, mn = b[B_MS], b[B_ML], b[B_MN]
            if wet:
                if ms <= 0.0 or ml <= 0.0:
                    continue
                row[K_ML], row[K_MN], row[K_D] = ml, mn, dt * b[B_D]
                row[K_BLX] = b[B_PLX] + dt * b[B_FLX]
                row[K_BLY] = b[B_PLY] + dt * (b[B_FLY] - ml * gravity)
                row[K_BSX] = b[B_PSX] + mn * b[B_PLX] / ml + dt * b[B_FX]
                row[K_BSY] = b[B_PSY] + mn * b[B_PLY] / ml + dt * (b[B_FY] - (ms + mn) * gravity)
            else:
                row[K_BSX] = b[B_PSX] + dt * b[B_FX]
                row[K_BSY] = b[B_PSY] + dt * (b[B_FY] - ms * gravity)
            row[K_MS] = ms

    return gather


@cache
def reaction_kernel(wet):
    """Kernel `react` for soil with pore water or without."""

    @kernel
    def react(row, nx, ny, friction, ux, uy, dt):
        """Impulse that a moving wall gives to a node in dt, and how it grows with the wall's velocity.

        row : (8,) float64, of `gather`;  ux, uy : velocity of the wall [m/s].

        Returns
        -------
        push, shear : float
            Normal (soil and water) and tangential impulse on the material [N s/m], the latter along (ny, -nx).
        push_n, shear_n, shear_t : float
            Derivatives by the normal and the tangential velocity of the wall [kg/m].
        """
        ms, ml, mn, d = row[K_MS], row[K_ML], row[K_MN], row[K_D]
        bsx, bsy = row[K_BSX] - (ms + mn) * ux, row[K_BSY] - (ms + mn) * uy
        bsn, bst = nx * bsx + ny * bsy, ny * bsx - nx * bsy
        push = push_n = grip = grip_n = shear = shear_n = shear_t = 0.0
        mass_t, free_t = ms, bst  # what friction must hold
        if wet:
            blx, bly = row[K_BLX] - ml * ux, row[K_BLY] - ml * uy
            bln, blt = nx * blx + ny * bly, ny * blx - nx * bly
            _, vl, r_s, r_l = wall_normal(bsn, bln, ms, ml, mn, d, dt)
            grip, push = dt * r_s, dt * (r_s + r_l)
            # the wall's mass matrix of what it holds: grains and water, water alone, grains alone
            if r_s > 0.0 and vl == 0.0:
                grip_n, push_n = ms + mn - ml, ms + mn
            elif r_s > 0.0:
                grip_n = push_n = ms + mn - mn * ml / (ml + d)
            elif r_l > 0.0:
                push_n = ml + d * (ms + mn - ml) / (ms + d)
            mass_t = ms + mn - mn * ml / (ml + d)
            free_t = bst - mn * blt / (ml + d)
        elif bsn < 0.0:
            grip = push = -bsn
            grip_n = push_n = ms
        if grip > 0.0:
            shear, shear_t = -free_t, mass_t
            limit = friction * grip
            if abs(shear) > limit:
                sign = 1.0 if shear > 0.0 else -1.0
                shear, shear_n, shear_t = sign * limit, sign * friction * grip_n, 0.0
        return push, shear, push_n, shear_n, shear_t

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
def velocity_kernel(wet):
    """Kernel `find_velocity` for soil with pore water or without."""
    react = reaction_kernel(wet)

    @kernel
    def find_velocity(
        state, rows, motion, normal, active, friction, effective_mass, due, dt, velocity, left, wall
    ):  # fmt: skip
        """Velocity of the ring and of the wall at its nodes, in place, by Newton's method.

        Parameters
        ----------
        state : (k, 8) float64
            Of `gather`.
        rows : (k,) int
            Rows of the contact arrays `normal`, `active`, `friction` and `wall`.
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
                c = rows[k]
                g = motion[k]
                ux = uy = 0.0
                for j in range(m):
                    ux += g[0, j] * velocity[j]
                    uy += g[1, j] * velocity[j]
                wall[c, 0], wall[c, 1] = ux, uy
                if not active[c] or state[k, K_MS] <= 0.0:
                    continue
                nx, ny = normal[c, 0], normal[c, 1]
                push, shear, push_n, shear_n, shear_t = react(state[k], nx, ny, friction[c], ux, uy, dt)
                if push == 0.0:
                    continue
                for j in range(m):
                    along[j], across[j] = nx * g[0, j] + ny * g[1, j], ny * g[0, j] - nx * g[1, j]
                for i in range(m):
                    felt = along[i] * push + across[i] * shear
                    residual[i] += felt
                    scale[i] += abs(felt)
                    by_n, by_t = along[i] * push_n + across[i] * shear_n, across[i] * shear_t
                    for j in range(m):
                        matrix[i, j] += by_n * along[j] + by_t * across[j]
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


class MovingLinings:
    """The linings of a scene that may move, and the velocities of their contact nodes.

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh
    contact_of_node : (n_nodes,) int32
        Row of the contact arrays or -1.
    rows_of_tunnel : list of (k,) int
        Contact rows of every tunnel.

    Attributes
    ----------
    displacement, velocity, left : (m,) float64
        Coordinates of all rings [m], their rates [m/s], and impulses taken into the next step [N s/m].
    wall : (n_contact, 2) float64
        Velocity of the lining at its contact nodes [m/s], of the step at hand.
    """

    def __init__(self, scene, mesh, contact_of_node, rows_of_tunnel):
        on_lining = np.flatnonzero(contact_of_node >= 0)
        self.node_of_contact = np.zeros(len(on_lining), np.int32)
        self.node_of_contact[contact_of_node[on_lining]] = on_lining
        wet = scene.water is not None
        self._gather, self._find, self._find_dry = gather_kernel(wet), velocity_kernel(wet), velocity_kernel(False)
        self.gravity = scene.gravity
        self.wall = np.zeros((len(on_lining), 2))
        self.parts = []
        rings = [(t, ring) for t, ring in enumerate(lining_ring(scene, tunnel) for tunnel in scene.tunnels) if ring]
        ends = np.cumsum([0, *(len(ring.weight) for _, ring in rings)])
        self.displacement, self.velocity, self.left = (np.zeros(ends[-1]) for _ in range(3))
        for (t, ring), first, last in zip(rings, ends, ends[1:], strict=False):
            rows, tunnel = np.asarray(rows_of_tunnel[t]), scene.tunnels[t]
            x, y = (mesh.nodes[self.node_of_contact[rows]] - [tunnel.x, -tunnel.axis_depth]).T
            theta, radius = np.arctan2(x, y), np.hypot(x, y)
            self.parts.append(
                SimpleNamespace(
                    tunnel=t,
                    ring=ring,
                    rows=rows,
                    motion=ring.motion(theta, radius),
                    state=np.zeros((len(rows), NODE_STATE)),
                    due=np.zeros(last - first),
                    **{name: getattr(self, name)[first:last] for name in ("displacement", "velocity", "left")},
                )
            )

    def advance(self, sums, dt, normal, active, friction):
        """Move the rings by dt [s] together with the material at their nodes; sets `wall`."""
        for part in self.parts:
            ring = part.ring
            self._gather(sums, dt, self.gravity, part.rows, self.node_of_contact, part.state)
            ring_impulse(ring.stiffness, ring.weight, part.displacement, dt, part.due)
            self._find(
                part.state, part.rows, part.motion, normal, active, friction, ring.effective_mass(dt), part.due, dt,
                part.velocity, part.left, self.wall,
            )  # fmt: skip
            part.displacement += dt * part.velocity

    def settle(self, force, held_liquid, mass, velocity, normal, active, friction):
        """One pseudo time step of 1 s of the drained relaxation (`mpm.stages`): moves the rings, sets `wall`.

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
            nodes, n = self.node_of_contact[rows], normal[rows]
            water = np.where(active[rows] > 0, np.maximum(-np.sum(n * held_liquid[nodes], axis=1), 0.0), 0.0)
            part.state[:, K_MS] = mass[nodes]
            part.state[:, K_BSX : K_BSY + 1] = mass[nodes, None] * velocity[nodes] + force[nodes] + water[:, None] * n
            ring_mass = ring.mass * (mass[nodes].sum() / ring.mass.diagonal().max())
            before = part.velocity.copy()
            ring_impulse(ring.stiffness, ring.weight, part.displacement + before, 1.0, part.due)
            part.due -= np.einsum("kdm,kd,k->m", part.motion, n, water)
            self._find_dry(
                part.state, rows, part.motion, normal, active, friction, ring_mass + ring.stiffness, part.due, 1.0,
                part.velocity, part.left, self.wall,
            )  # fmt: skip
            part.displacement += part.velocity
            momentum = np.einsum("ij,j->i", ring_mass, part.velocity)
            energy += float(np.sum(part.velocity * momentum))
            unbalanced += float(np.sum(np.einsum("ij,j->i", ring_mass, part.velocity - before) ** 2))
        return energy, unbalanced

    def halt(self):
        """Bring the rings to rest where they are."""
        self.velocity[:] = 0.0
        self.left[:] = 0.0

    def motion_at(self, tunnel, theta):
        """Displacement of the outer face, and the forces of an elastic ring, at theta [degrees].

        Returns
        -------
        dict of str to (n,) float64
            displacement_radial, displacement_tangential [m], outward and clockwise; for an elastic ring axial_force,
            shear_force [N/m], bending_moment [N m/m] of :meth:`mpm.lining.ElasticRing.internal_forces`. Zero and
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
        if isinstance(part.ring, ElasticRing):
            forces = part.ring.internal_forces(part.displacement, a)
            result |= dict(zip(("axial_force", "shear_force", "bending_moment"), forces, strict=True))
        return result


def lining_ring(scene, tunnel):
    """The ring that moves as a tunnel's lining, or None where it is fixed."""
    geometry = tunnel.outer_radius, tunnel.inner_radius, tunnel.lining_density, scene.gravity
    kind = scene.lining_of(tunnel)
    if kind == "elastic":
        return ElasticRing.build(
            *geometry, tunnel.lining_modulus, tunnel.lining_poissons_ratio, tunnel.lining_harmonics
        )
    return RigidRing.build(*geometry) if kind == "floating" else None
