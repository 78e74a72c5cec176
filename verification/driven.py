"""A solver whose nodes may be moved, pushed or damped from outside: walls, footings, tractions, slow loading."""

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y, block
from mpm.solver import Solver
from mpm.step.substep import ADVANCE, PLAN, REMAP, SOLVE, UPDATE


class DrivenSolver(Solver):
    """`mpm.Solver` with velocities or forces given at nodes, and local damping of the grains.

    Parameters
    ----------
    scene, mesh : as for :class:`mpm.Solver`; all elements take the same time step.
    damping : float
        Share of the change of each nodal velocity component that is taken off where it speeds the node up, and added
        where it slows it down [-]; 0 is none. Cundall (1987): a steady state keeps its loads. Not at driven nodes.

    Attributes
    ----------
    driven : (n_nodes, 2) bool
        Components whose velocity is given;  velocity : (n_nodes, 2) that velocity [m/s].
    driven_liquid, velocity_liquid : the same of the pore water.
    force : (n_nodes, 2) float64
        Forces on the nodes from outside [N/m].
    reaction : (n_nodes, 2) float64
        Force of the drive on the soil in the last step [N/m], inertia included.
    """

    def __init__(self, scene, mesh, damping=0.0):
        together = scene.numerics.model_copy(update={"local_time_stepping": False})
        super().__init__(scene.model_copy(update={"numerics": together}), mesh, threads=1)
        shape = (len(mesh.nodes), 2)
        self.damping = damping
        self.driven, self.velocity = np.zeros(shape, bool), np.zeros(shape)
        self.driven_liquid, self.velocity_liquid = np.zeros(shape, bool), np.zeros(shape)
        self.force, self.reaction = np.zeros(shape), np.zeros(shape)

    def let_drain(self, conductivity, gravity=9.81):
        """Give a weightless scene the drag that its conductivity [m/s] has under gravity [m/s2]."""
        self.soils["drag"] = gravity / conductivity

    def _advance(self, batch):
        self._run(PLAN, SOLVE, batch)
        self._drive(float(self.clock.dt_of_level[0]))
        self._run(ADVANCE, REMAP)
        moved = self.driven & (self.nodes["mass_solid"] > 0)[:, None]
        block(self.nodes, "velocity_solid_x", "velocity_solid_y")[moved] = self.velocity[moved]
        block(self.nodes, "velocity_liquid_x", "velocity_liquid_y")[self.driven_liquid] = self.velocity_liquid[
            self.driven_liquid
        ]
        self._run(UPDATE, UPDATE)

    def _drive(self, dt):
        row = self.nodes
        mass = row["mass_solid"][:, None]
        full = mass > 0
        velocity, change = (block(row, f"{name}_solid_x", f"{name}_solid_y") for name in ("velocity", "change"))
        free = (np.column_stack([self.fixed & FIXED_X, self.fixed & FIXED_Y]) == 0) & full
        push = np.where(free, dt * self.force / np.where(full, mass, 1.0), 0.0)
        velocity += push
        change += push
        if self.damping > 0:
            drag = np.where(free & ~self.driven, self.damping * np.abs(change) * np.sign(velocity), 0.0)
            velocity -= drag
            change -= drag
        moved = self.driven & full
        jump = np.where(moved, self.velocity - velocity, 0.0)
        self.reaction[:] = mass * jump / dt
        velocity += jump
        change += jump
        if self.scene.is_two_phase and jump.any():  # drag is implicit: grains that are driven take the water along
            drag = dt * self.nodal_sums()["drag"][:, None]
            jump *= drag / np.where(full, row["mass_liquid"][:, None] + drag, 1.0)
            block(row, "velocity_liquid_x", "velocity_liquid_y")[:] += jump
            block(row, "change_liquid_x", "change_liquid_y")[:] += jump
        moved = self.driven_liquid & full
        velocity, change = (block(row, f"{name}_liquid_x", f"{name}_liquid_y") for name in ("velocity", "change"))
        jump = np.where(moved, self.velocity_liquid - velocity, 0.0)
        velocity += jump
        change += jump
