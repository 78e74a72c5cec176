"""Bytes that a point-step moves and operations that it does, counted from the arrays and from the kernels' source.

Bytes: what must come from memory and go back when nothing stays in the cache between passes. A point's row is read and
written in each of the two passes over the points, with its place in the order and its soil's number; an element's
record and a node's row are read once a pass. Operations: additions, subtractions, multiplications and divisions in the
source of the loops over an element's points, all branches counted, the return mapping up to its elastic exit; those
per element and node are divided among the points.
"""

import ast
import inspect
import textwrap

import numpy as np

PASSES = 2  # over the points
ELEMENT_PASSES = 2


def bytes_per_point_step(solver):
    """Bytes read and written per point and step [B] by points, elements and nodes: dict."""
    points, mesh = solver.n_points, solver.mesh
    row = solver.points.itemsize
    of_points = PASSES * (2 * row + solver.order.itemsize + solver.soil_of_point.itemsize)
    record = solver.geometry[0].nbytes + mesh.elements[0].nbytes + solver.occupied.itemsize + solver.start.itemsize
    # contents are written by one pass, and read by both
    of_elements = ELEMENT_PASSES * record + 3 * solver.contents[0].nbytes
    # written, read and cleared where a part of the mesh adds to a row; then read by the passes that interpolate
    row_of_sums = solver.sums[0, 0].nbytes + solver.momenta[0, 0].nbytes
    of_nodes = 3 * row_of_sums * np.count_nonzero(solver.touched) + (ELEMENT_PASSES + 2) * solver.nodes.nbytes
    return {
        "points": float(of_points),
        "elements": of_elements * np.count_nonzero(np.diff(solver.start)) / points,
        "nodes": of_nodes / points,
    }


def operations_per_point_step(solver):
    """Floating-point operations in the loops over points of a step's kernels: dict of kernel name to count."""
    counts = {}
    for kernel in solver.kernels:
        tree = ast.parse(textwrap.dedent(inspect.getsource(kernel.py_func)))
        function = next(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
        loops = [node for node in ast.walk(function) if isinstance(node, ast.For) and _over_points(node)]
        if loops:
            counts[kernel.py_func.__name__] = sum(_operations(loop) for loop in loops)
    return counts


def _over_points(loop):
    return isinstance(loop.iter, ast.Call) and any(
        isinstance(node, ast.Name) and node.id == "start" for node in ast.walk(loop.iter)
    )


def _operations(tree):
    counted = ast.Add | ast.Sub | ast.Mult | ast.Div
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, counted):
            count += 1
    return count
