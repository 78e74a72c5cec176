"""What the page of `gush stability` says around its numbers."""

LINEAR = """
## The critical time step

A step of the solver is affine in the state about rest while points stay in their elements, soils are elastic and pore
pressures positive. Steps from perturbed states, run by the solver itself, are therefore the columns of its exact
amplification matrix; its spectral radius, bisected over the time step, gives the *actual* critical step. The program
has two predictions, each its time step at Courant number 1: *altitude*, the smallest altitude over the undrained,
undamped wave speed, and *spectral* (`numerics.critical_step = "spectral"`), 0.9 times the step of the largest
eigenvalue of the points on their mesh (`mpm/spectrum.py`). The column is four cells high and two wide, of crossed
triangles. The actual step is where a mode begins to grow by 1 % a step. "Growth" is the largest excess of the
spectral radius over 1 at half of it, "leak" the largest share of a result outside of the invariant space on which the
matrix is formed, which is round-off.
"""

READING = """
- Why the altitude is so far off: velocities return to the nodes through the points, which takes the shortest waves
  away (in one dimension with a consistent mass: a factor of sqrt(8/3) = 1.63 in the step); drag locks the water to the
  grains; and a flat element has neighbours that are not. Points gathered at vertices, flat elements and stress that
  runs ahead make it worse than the truth. No factor on the altitude can serve: its ratio varies with positions and
  shapes by more than 1/0.7.
- Stress that runs ahead by a share a of a step (`stress_damping`) divides the critical step by sqrt(1 + 2 a). That is
  exact mode by mode, also with implicit drag: only the real root at -1 leaves the unit circle.
- PIC makes the critical step up to sqrt(2) smaller than FLIP; the spectral prediction counts it, the altitude's does
  not.
- The default is "spectral" at a Courant number of 0.8. Estimates are renewed after 5 to 200 steps, soon where the last
  one had fallen; points move in between, and the margin for that is the Courant number.
- Both hold for resting, elastic states. Plastic flow softens. For the spectral step what is loose counts as stiff and
  what is slack as pressed, so that closing up cannot make it too long.
"""

EXTREMES = """
Small scenes, each in a process of its own with a time limit: a block in a closed box that loses its support, a lump
thrown at a wall, a coarse tunnel with a gate. A run is *stable* when all of this holds, at every step or every 20
steps:

- the energy that is there (kinetic, skeleton, water) never exceeds the initial one plus the work of gravity by more
  than 5 % of the largest energy in play;
- the mass at the nodes is that of the points to 1e-10;
- no stress and no pressure exceeds three times the sum of static load and Joukowsky pressure of the fastest point;
- points stay in the mesh, porosities in their range, everything is finite;
- no more comes in through the gate than by free discharge under the total head, and nothing while it is closed;
- weightless ground does not move, a full tunnel stays at rest, one point falls as far and as fast as it must.

*Refused* means that the scene is not accepted and says why. Everything else, a failed run included, is a bug.
"""

FOUND = """
## What was found

Numbers of this list are of trials made while this command was written; the table above is of today.

- **No weight.** A scene without gravity divided zero by zero in its relaxation. Repaired. The drag is gravity over
  conductivity, so it vanishes with gravity: a conductivity is that of the scene's gravity.
- **Corners of the gate.** The corners of an open gate push in one direction only, so a tunnel filled with ground in
  equilibrium moves there at first, at up to 0.3 m/s, and comes to rest.
- The gate can be closed again (`Solver.close_gate`).
- **Points that begin on vertices.** Their first spectral step is 1.9 times that of the altitude, five steps later it is
  0.6 times: they have left the vertices. With an estimate every 200 steps a block gained as much energy as was in play.
  Repaired: the next estimate follows after five steps where the step had fallen by a tenth, and waits twice as long
  where it had not.
- **A few points.** One point inside an element resists nothing until it meets a wall; the spectrum called any step
  stable. Beyond four times the step of the altitude the estimate is not believed, and half of that step is taken.
- **Steps of their own.** Forces held over the step of a coarse element act late at nodes with finer steps, and fed
  undamped waves; see [numerics.md](numerics.md).

## What is not covered

Linear columns are uniform: one soil, one cell size, so one level; that waves do not grow across levels is shown by
`tests/physics/test_local_time_stepping.py`. Kinetic energy in the water counts at the points, which move with
the grains; water that runs through gravel carries its momentum but not its place. Runs are coarse and short; that
they are stable says nothing about accuracy.
"""
