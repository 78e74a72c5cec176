"""The balance of impulses on a ring that moves with the material at its contact nodes, and its derivatives: kernels."""

from functools import cache

import numpy as np

from mpm.fields import record
from mpm.machine.compile import kernel, kernel_part
from mpm.step.nodes import free_kernel, moved, sum_kernel, velocities_of
from mpm.walls.contact import Masses, Pair, response_kernel

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


@kernel
def ring_impulse(stiffness, weight, displacement, dt, due):
    """dt (weight - K x), written to `due` (m,) [N s/m]."""
    for i in range(due.size):
        force = weight[i]
        for j in range(due.size):
            force -= stiffness[i, j] * displacement[j]
        due[i] = dt * force
