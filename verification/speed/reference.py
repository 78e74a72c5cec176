"""What the solver is measured against in the same process: a plain single-phase loop, and a copy of memory.

The loop is what a textbook MLS-MPM code does per point and step: quadratic B-splines on a square grid, APIC
transfer, a weakly compressible fluid; one phase, one stress number, no contact. Source: Hu et al. (2018), the 88-line
program that comes with it.
"""

import math
import time as clock

import numba
import numpy as np


def copy_bandwidth(megabytes=256, rounds=3):
    """Bytes read and written per second of processor time by one thread that copies an array larger than the cache."""
    source = np.ones(megabytes * 125_000)
    target = np.zeros_like(source)
    best = math.inf
    for _ in range(rounds):
        begin = clock.process_time()
        target[:] = source
        best = min(best, clock.process_time() - begin)
    return 2 * source.nbytes / best


class ReferenceLoop:
    """A block of fluid falling in a box, four points a cell.

    n_points : int.
    """

    def __init__(self, n_points):
        # the block fills a quarter of the box
        self.cells = max(16, 2 * math.ceil(math.sqrt(n_points / 4)))
        rng = np.random.default_rng(1)
        self.position = 0.25 + 0.5 * rng.random((n_points, 2))
        # sorted by cell, as the points of the solver are by element
        column, row = (self.position * self.cells).astype(int).T
        self.position = np.ascontiguousarray(self.position[np.lexsort((row, column))])
        self.velocity = np.zeros((n_points, 2))
        self.affine = np.zeros((n_points, 2, 2))
        self.volume_ratio = np.ones(n_points)
        self.grid = np.zeros((self.cells, self.cells, 3))

    def step(self):
        """Advance by one step."""
        dt = 0.02 / self.cells
        reference_step(self.position, self.velocity, self.affine, self.volume_ratio, self.grid, self.cells, dt)


@numba.njit(fastmath=True)
def reference_step(position, velocity, affine, volume_ratio, grid, cells, dt):
    """One step of weakly compressible MLS-MPM in the unit square, in place.

    position, velocity : (n, 2) float64;  affine : (n, 2, 2) float64;  volume_ratio : (n,) float64
    grid : (cells, cells, 3) float64, momentum and mass;  dt in units where gravity is 9.8 and the wave speed 20.
    """
    spacing, inverse = 1.0 / cells, float(cells)
    volume = (0.5 * spacing) ** 2
    stiffness = 400.0
    weight_x, weight_y = np.empty(3), np.empty(3)
    grid[:] = 0.0
    for i in range(len(position)):
        x, y = position[i, 0] * inverse, position[i, 1] * inverse
        column, row = int(x - 0.5), int(y - 0.5)
        fx, fy = x - column, y - row
        weight_x[0], weight_x[1], weight_x[2] = 0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2
        weight_y[0], weight_y[1], weight_y[2] = 0.5 * (1.5 - fy) ** 2, 0.75 - (fy - 1) ** 2, 0.5 * (fy - 0.5) ** 2
        stress = -dt * 4 * stiffness * volume * (volume_ratio[i] - 1) * inverse * inverse
        a00, a01 = stress + volume * affine[i, 0, 0], volume * affine[i, 0, 1]
        a10, a11 = volume * affine[i, 1, 0], stress + volume * affine[i, 1, 1]
        for a in range(3):
            for b in range(3):
                dx, dy = (a - fx) * spacing, (b - fy) * spacing
                weight = weight_x[a] * weight_y[b]
                grid[column + a, row + b, 0] += weight * (volume * velocity[i, 0] + a00 * dx + a01 * dy)
                grid[column + a, row + b, 1] += weight * (volume * velocity[i, 1] + a10 * dx + a11 * dy)
                grid[column + a, row + b, 2] += weight * volume
    for a in range(cells):
        for b in range(cells):
            if grid[a, b, 2] > 0:
                vx, vy = grid[a, b, 0] / grid[a, b, 2], grid[a, b, 1] / grid[a, b, 2] - dt * 9.8
                if (a < 3 and vx < 0) or (a > cells - 4 and vx > 0):
                    vx = 0.0
                if (b < 3 and vy < 0) or (b > cells - 4 and vy > 0):
                    vy = 0.0
                grid[a, b, 0], grid[a, b, 1] = vx, vy
    for i in range(len(position)):
        x, y = position[i, 0] * inverse, position[i, 1] * inverse
        column, row = int(x - 0.5), int(y - 0.5)
        fx, fy = x - column, y - row
        weight_x[0], weight_x[1], weight_x[2] = 0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2
        weight_y[0], weight_y[1], weight_y[2] = 0.5 * (1.5 - fy) ** 2, 0.75 - (fy - 1) ** 2, 0.5 * (fy - 0.5) ** 2
        vx = vy = c00 = c01 = c10 = c11 = 0.0
        for a in range(3):
            for b in range(3):
                dx, dy = a - fx, b - fy
                weight = weight_x[a] * weight_y[b]
                gx, gy = grid[column + a, row + b, 0], grid[column + a, row + b, 1]
                vx += weight * gx
                vy += weight * gy
                c00 += 4 * inverse * weight * gx * dx
                c01 += 4 * inverse * weight * gx * dy
                c10 += 4 * inverse * weight * gy * dx
                c11 += 4 * inverse * weight * gy * dy
        velocity[i, 0], velocity[i, 1] = vx, vy
        affine[i, 0, 0], affine[i, 0, 1], affine[i, 1, 0], affine[i, 1, 1] = c00, c01, c10, c11
        position[i, 0] = min(max(position[i, 0] + dt * vx, 2 * spacing), 1 - 2 * spacing)
        position[i, 1] = min(max(position[i, 1] + dt * vy, 2 * spacing), 1 - 2 * spacing)
        volume_ratio[i] *= 1 + dt * (c00 + c11)
