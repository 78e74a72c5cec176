"""The state of a solver: everything that decides its future and does not follow from scene and mesh.

What is not in the tables below is either built from scene and mesh, sorted anew from the elements of the points, or
written by each step before it is read; a test restores into a solver whose other arrays are filled with NaN.
"""

import numpy as np

#: Arrays, copied in place. `sums` holds the points as mapped at the end of the last step, in its order of summation.
ARRAYS = (
    "points", "element_of_point", "soil_of_point", "initial_volume", "nodes", "sums", "contents", "impulse",
    "clamps", "ledger", "lining_displacement", "lining_velocity", "lining_impulse", "joint_memory",
)  # fmt: skip
#: Numbers: simulated time [s], counters, grains taken out [kg/m], speed of the fast wave and that which gives
#: the step [m/s], spectral step [s].
NUMBERS = (
    "time", "step_count", "long_step_count", "point_steps", "removed_mass", "suspended",
    "estimate_interval", "next_estimate", "wave_speed", "limit_speed", "largest_courant",
    "longest_step",
)  # fmt: skip


def solver_state(solver):
    """State of a solver between two steps.

    Parameters
    ----------
    solver : mpm.solver.Solver

    Returns
    -------
    dict of str to array, float, int or bool
        The arrays are the solver's own: store them before the next step.
    """
    state = {name: getattr(solver, name) for name in (*ARRAYS, *NUMBERS, "gate_open")}
    state["mode"] = np.zeros(0) if solver.mode is None else solver.mode
    state["mapped"] = solver._mapped
    state["limits"] = solver._limits.copy() if solver._mapped else np.zeros((0, 2))
    return state


def restore_solver(solver, state):
    """Continue a freshly built solver of the same scene and mesh from `state`: the same bits from here on, in place.

    Raises
    ------
    ValueError
        When an array is missing or has another shape or type: the state is that of another scene or mesh.
    """
    for name in ARRAYS:
        mine, stored = getattr(solver, name), np.asarray(state[name])
        if mine.shape != stored.shape or mine.dtype != stored.dtype:
            raise ValueError(
                f"state of a solver: {name} must be {mine.shape} {mine.dtype}, got {stored.shape} {stored.dtype}; "
                "restore it with the scene and the mesh that it was taken with"
            )
    for name in ARRAYS:
        getattr(solver, name)[:] = state[name]
    solver.momenta[:] = 0.0  # empty between two steps
    solver.touched[:] = 1
    for name in NUMBERS:
        setattr(solver, name, type(getattr(solver, name))(state[name]))
    solver.mode = np.array(state["mode"], float) if len(state["mode"]) else None
    if state["gate_open"]:
        solver.open_gate()
    solver._sort()
    solver._mapped = bool(state["mapped"])
    if solver._mapped:
        solver._limits[:] = state["limits"]
