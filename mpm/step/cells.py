"""What a quadrilateral cell of four triangles holds: how full it is, and the pore pressure that its nodes feel.

Elements 4 q .. 4 q + 3 are the triangles into which both diagonals cut quadrilateral q (`mpm.mesh`).
"""

from mpm.machine.compile import index, inline_kernel, kernel, kernel_part

# Area spanned by the ways between the points' centres in opposite elements, over that of the quadrilateral, below which
# they give no slope; 4/9 where they lie in the middle of their elements.
UNKNOWN_SLOPE = 0.05
# Volume of points over area from which a quadrilateral begins to count as one without free surface, and does so fully.
HALF_FULL, FULL = 0.5, 0.75


@kernel_part
def fill_of_cell(first, geometry, contents):
    """Share of its area that the stresses in a quadrilateral count with, 0: with the volume of its points.

    Where ground is, the mean stress of each triangle counts with the triangle's area, not with the volume of the points
    that are in it by chance: of three points one that crosses an edge takes a third of the force along, and the ground
    answers with stresses that differ by as much. At a free surface the points of the quadrilateral count, evenly over
    its triangles; from half full to three quarters the one passes into the other. One triangle may be empty
    (`is_carried`), of two nothing is known.

    first : int
        First element of the quadrilateral.

    Source: mixed integration of the material point method, Al-Kafaji (2013), Formulation of a dynamic material point
    method for geomechanical problems, section 4.3, there from 90 % on.
    """
    volume = area = 0.0
    empty = 0
    for e in range(first, first + 4):
        empty += contents[index(e)].volume <= 0.0
        volume += contents[index(e)].volume
        area += geometry[index(e)].area
    if empty > 1:
        return 0.0
    fill = min(volume / area, 1.0)
    return fill + (1.0 - fill) * min(max((fill - HALF_FULL) / (FULL - HALF_FULL), 0.0), 1.0)


@kernel_part
def fill_cell(e, start, geometry, contents):
    """Write `fill_of_cell` for all triangles of the quadrilateral of an element, if that is its first with points."""
    first = e & ~index(3)
    if start[first] == start[e]:
        fill = fill_of_cell(first, geometry, contents)
        for k in range(4):
            contents[first + index(k)].fill = fill


@kernel
def fill_cells(geometry, contents):
    """Write `fill_of_cell` for all elements."""
    for first in range(0, contents.size, 4):
        fill = fill_of_cell(index(first), geometry, contents)
        for e in range(first, first + 4):
            contents[e].fill = fill


@inline_kernel
def felt_share(volume, area, fill):
    """What the stresses of an element's points count with, over their volume."""
    return fill * area / volume if fill > 0.0 and volume > 0.0 else 1.0


@inline_kernel
def is_carried(e, start, fill):
    """Whether an element without points has the mean stress of those beside it, since there is ground around it."""
    return fill > 0.0 and start[e] == start[e + 1]


@kernel_part
def resolved_pressure(e, geometry, contents):
    """What the nodes feel of the pore pressure in an element: its mean, and its place and slope.

    The forces of an element are those of the sum of v p over its points, whatever each of them has. The differences are
    in the null space of the map to the nodes: no velocity answers to them, and what points bring along from other
    elements stays in it for good.

    Returns
    -------
    mean, x, y, slope_x, slope_y, share : float
        Volume mean of the pressure [Pa], at (x, y) [m]; slope [Pa/m] of the quadrilateral,
        lessened where the pressure would be negative at a corner of the element; share 0 where the quadrilateral is not
        occupied throughout, or its points lie almost on a line: nothing is known then, else 1.

    Source: Gritton & Berzins (2017), Improving accuracy in the MPM method using a null space filter.
    """
    first = e & ~index(3)
    a, b = contents[first], contents[first + index(1)]
    c, d = contents[first + index(2)], contents[first + index(3)]
    va, vb, vc, vd = a.volume, b.volume, c.volume, d.volume
    if min(va, vb, vc, vd) <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # reciprocals: of an element's work a division is the dearest
    ia, ib, ic, id_ = 1.0 / va, 1.0 / vb, 1.0 / vc, 1.0 / vd
    ux, uy = a.x * ia - c.x * ic, a.y * ia - c.y * ic
    wx, wy = b.x * ib - d.x * id_, b.y * ib - d.y * id_
    det = ux * wy - uy * wx
    area = geometry[first].area + geometry[first + index(1)].area
    area += geometry[first + index(2)].area
    area += geometry[first + index(3)].area
    if det < UNKNOWN_SLOPE * area:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    along = (a.pressure * ia - c.pressure * ic) / det
    across = (b.pressure * ib - d.pressure * id_) / det
    sx, sy = wy * along - uy * across, ux * across - wx * along
    own, shape = contents[e], geometry[e]
    v = 1.0 / own.volume
    mean, x, y = own.pressure * v, own.x * v, own.y * v
    area2 = 2.0 * shape.area
    p0 = sx * (shape.x - x) + sy * (shape.y - y)
    p1 = p0 + (sx * shape.dn2_dy - sy * shape.dn2_dx) * area2
    p2 = p0 + (sy * shape.dn1_dx - sx * shape.dn1_dy) * area2
    low = -min(p0, p1, p2)
    if low > mean:
        sx *= mean / low
        sy *= mean / low
    return mean, x, y, sx, sy, 1.0
