"""Points by the element that holds them: sorted once, repaired when a few have moved, cut into parts of equal work."""

import numpy as np

from mpm.machine.compile import index, integer_kernel, kernel_part

ELEMENT_WORK = 2  # what an element costs in a step beside its points, in points


@integer_kernel
def sort_by_element(element_of_point, n_elements, start, order, occupied):
    """Counting sort: points of element e become order[start[e]:start[e + 1]], in ascending point number.

    Points with a negative element are left out. Returns the number of occupied elements and of points.
    """
    for e in range(n_elements + 1):
        start[e] = 0
    for i in range(element_of_point.size):
        if element_of_point[i] >= 0:
            start[element_of_point[i] + 1] += 1
    filled = 0
    for e in range(n_elements):
        if start[e + 1] > 0:
            occupied[filled] = e
            filled += 1
        start[e + 1] += start[e]
    for i in range(element_of_point.size):
        e = element_of_point[i]
        if e >= 0:
            order[start[e]] = i
            start[e] += 1
    for e in range(n_elements, 0, -1):
        start[e] = start[e - 1]
    start[0] = 0
    return filled, start[n_elements]


@kernel_part
def place_of(value, ascending, low, high):
    """First place in a range of an array that is not below a value (numpy's takes two seconds to compile)."""
    while low < high:
        middle = (low + high) // 2
        if ascending[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@integer_kernel
def cut_by_work(start, occupied, n_occupied, layout, n_levels, cuts):
    """Cut the occupied elements of the finest levels into parts of about as much work, and nodes with them.

    So whoever takes the same part of every pass finds most of what it needs where it left it, in its own cache.

    Parameters
    ----------
    layout : Layout
    cuts : Cuts
        Written, but for `solved`: places in the list of occupied elements and of nodes. The elements of further
        levels are shifted with the list.
    """
    parts = cuts.elements.shape[1] - 1
    change = n_occupied - cuts.elements[-1, -1]
    for level in range(n_levels, cuts.elements.shape[0]):
        for part in range(parts + 1):
            cuts.elements[level, part] += change
    end = 0
    for level in range(n_levels):
        begin, after = start[layout.element_cuts[level]], start[layout.element_cuts[level + 1]]
        first = low = end
        end = place_of(layout.element_cuts[level + 1], occupied, low, n_occupied)
        work = after - begin + ELEMENT_WORK * (end - first)
        node, last_node = layout.node_cuts[level], layout.node_cuts[level + 1]
        cuts.elements[level, 0], cuts.nodes[level, 0] = first, node
        for part in range(1, parts):
            high = end
            while low < high:
                middle = (low + high) // 2
                before = start[occupied[middle]] - begin + ELEMENT_WORK * (middle - first)
                if before * parts < part * work:
                    low = middle + 1
                else:
                    high = middle
            element = occupied[low] if low < end else layout.element_cuts[level + 1]
            node = place_of(element, layout.first_of_node, node, last_node)
            cuts.elements[level, part], cuts.nodes[level, part] = low, node
        cuts.elements[level, parts], cuts.nodes[level, parts] = end, last_node


@kernel_part
def shift_ranges(array, spare, ranges, count):
    """Move ranges of an array, which stay in their order, by so many places each.

    ranges : (n, 3) int64
        First and last place (exclusive) and shift of the first `count` ranges, ascending.
    spare : as `array`.
    """
    # What moves down never lands on what has yet to move up, nor the other way round.
    for k in range(count):
        if ranges[k, 2] < 0:
            shift_range(array, spare, ranges[k, 0], ranges[k, 1], ranges[k, 2])
    for k in range(count - 1, -1, -1):
        if ranges[k, 2] > 0:
            shift_range(array, spare, ranges[k, 0], ranges[k, 1], ranges[k, 2])


@kernel_part
def shift_range(array, spare, first, last, shift):
    """Move one range of an array; by way of another array, so that copying is not slowed by what overlaps."""
    for j in range(first, last):
        spare[index(j)] = array[index(j)]
    for j in range(first, last):
        array[index(j + shift)] = spare[index(j)]


@kernel_part
def sink(keys, root, end):
    """Let a number of a heap, which is the first `end` entries, sink below those that are larger."""
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and keys[child] < keys[child + 1]:
            child += 1
        if keys[root] >= keys[child]:
            return
        keys[root], keys[child] = keys[child], keys[root]
        root = child


@kernel_part
def ascend(keys, count):
    """Sort the first `count` of some whole numbers in place, by a heap (numpy's sort takes two seconds to compile)."""
    for parent in range(count // 2 - 1, -1, -1):
        sink(keys, parent, count)
    for end in range(count - 1, 0, -1):
        keys[0], keys[end] = keys[end], keys[0]
        sink(keys, 0, end)


@kernel_part
def pair(first, second):
    """Two numbers from 0 to 2^31 in one, ordered by the first."""
    return (np.int64(first) << 32) + np.int64(second)


@kernel_part
def unpair(key):
    """The numbers of :func:`pair`."""
    return key >> 32, key & 0xFFFFFFFF


@kernel_part
def list_touched(element_of_point, moved, n_moved, touched, arriving):
    """Elements that points have left or reached, and :func:`pair` of element and point for those that arrive.

    touched, arriving : (2 n_moved,), (n_moved,) int64
        Written: ascending; an element once.
    Returns the number of both.
    """
    n_listed, n_arriving = 0, 0
    for k in range(n_moved):
        i, touched[n_listed] = unpair(moved[k])
        n_listed += 1
        goal = element_of_point[i]
        if goal >= 0:
            touched[n_listed], arriving[n_arriving] = goal, pair(goal, i)
            n_listed, n_arriving = n_listed + 1, n_arriving + 1
    ascend(touched, n_listed)
    ascend(arriving, n_arriving)
    n_touched = 0
    for k in range(n_listed):
        if n_touched == 0 or touched[k] != touched[n_touched - 1]:
            touched[n_touched] = touched[k]
            n_touched += 1
    return n_touched, n_arriving


@integer_kernel
def update_order(element_of_point, moved, n_moved, start, order, occupied, n_occupied, spare):
    """Repair the sorting by element in place after a few points have moved, shifting what lies between their elements.

    Equal to `sort_by_element` to the last entry.

    moved : (n,) int64
        The first n_moved entries, ascending: :func:`pair` of a point and the element that it has left.
    spare
        As `order`, for copies on the way.
    Returns the number of occupied elements and of points.
    """
    n_elements = start.size - 1
    touched, arriving = np.empty(2 * n_moved, np.int64), np.empty(n_moved, np.int64)
    n_touched, n_arriving = list_touched(element_of_point, moved, n_moved, touched, arriving)
    n_held = n_arriving
    for t in range(n_touched):
        n_held += start[touched[t] + 1] - start[touched[t]]
    # the new lists of these elements, one after the other
    held, ends, n_new, a = np.empty(n_held, np.int32), np.empty(n_touched, np.int64), 0, 0
    for t in range(n_touched):
        e = touched[t]
        read = start[e]
        while True:
            coming = -1
            if a < n_arriving:
                goal, i = unpair(arriving[a])
                coming = i if goal == e else -1
            if read < start[e + 1] and (coming < 0 or order[read] < coming):
                i = order[read]
                read += 1
                if element_of_point[i] == e:
                    held[n_new] = i
                    n_new += 1
            elif coming >= 0:
                a += 1
                if read < start[e + 1] and order[read] == coming:
                    read += 1  # it left and came back
                held[n_new] = coming
                n_new += 1
            else:
                break
        ends[t] = n_new
    # what lies between them moves
    ranges, shift, first_changed = np.empty((n_touched, 3), np.int64), 0, n_elements
    for t in range(n_touched):
        e = touched[t]
        count, before = ends[t] - (ends[t - 1] if t > 0 else 0), start[e + 1] - start[e]
        shift += count - before
        ranges[t, 0], ranges[t, 2] = start[e + 1], shift
        ranges[t, 1] = start[touched[t + 1]] if t + 1 < n_touched else start[n_elements]
        if (count > 0) != (before > 0):
            first_changed = min(first_changed, e)
    shift_ranges(order, spare, ranges, n_touched)
    k = 0
    for t in range(n_touched):
        e = touched[t]
        j = start[e]
        while k < ends[t]:
            order[j] = held[k]
            j, k = j + 1, k + 1
        last = touched[t + 1] if t + 1 < n_touched else n_elements
        if ranges[t, 2] != 0:
            for f in range(e + 1, last + 1):
                start[index(f)] += ranges[t, 2]
    if first_changed < n_elements:
        n_occupied = place_of(first_changed, occupied, 0, n_occupied)
        for e in range(first_changed, n_elements):
            if start[e + 1] > start[e]:
                occupied[n_occupied] = e
                n_occupied += 1
    return n_occupied, start[n_elements]
