"""The fewest nodes of a table between which blending linearly keeps a bound.

docs/method/scenes.md#fewest-nodes

An error in a cell depends on its four corners alone. So a choice of speeds and of forces is good
where each of its cells is, and the fewest forces for a choice of speeds are a shortest path through
cells. All choices of speeds are looked at that could still be cheaper: the result is the cheapest.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from functools import cache

import numpy as np

from modeling.arrays import Bools, Floats, Integers
from modeling.scenes.error_maps import ErrorMaps, Segment, segments_of
from modeling.scenes.measures import Errors
from modeling.scenes.places import Places, enclosing
from modeling.scenes.scene import Bound, Range

Nodes = tuple[int, ...]


def fewest_nodes(
    maps: ErrorMaps, places: Places, *, bound: Bound, taken: Errors
) -> tuple[Nodes, Nodes] | None:
    """Speeds and forces of a table, as indices, that keep a bound with the fewest numbers.

    Parameters
    ----------
    maps : ErrorMaps
    places : Places
        Where the bound counts.
    bound : Bound
    taken : Errors
        What of it is taken already at each node, (P,).

    Returns
    -------
    two tuples of int, or None
        The first may be below the scene and the last above it. None where what is taken breaks the
        bound.
    """
    good = _Cells(maps, places, bound=bound, taken=taken)
    speeds = _Axis(places.speeds_mm_s, places.speed_range)
    forces = _Axis(places.forces_n, places.force_range)
    width = 1 + 3 * maps.model.n_layers
    best: tuple[int, Nodes, Nodes] | None = None

    for rows in speeds.choices(lambda row: forces.shortest(good.columns([row])) is not None):
        size = speeds.size_of(rows)
        if best is not None and _numbers(size, forces.least, width) >= best[0]:
            break  # those to come are no smaller
        columns = _fewest_columns(forces, good, segments_of(rows))
        if columns is not None:
            numbers = _numbers(size, forces.size_of(columns), width)
            if best is None or numbers < best[0]:
                best = numbers, rows, columns
    return None if best is None else best[1:]


def _fewest_columns(forces: _Axis, good: _Cells, rows: list[Segment]) -> Nodes | None:
    """The fewest forces with which all cells are good: of those that seem so, until they are."""
    while True:
        columns = forces.shortest(good.columns(rows))
        if columns is None or good.are_good(rows, segments_of(columns)):
            return columns


def _numbers(speeds: int, forces: int, width: int) -> int:
    """Of a table with these axes; one of a single value is stored twice."""
    return max(speeds, 2) * max(forces, 2) * width + max(speeds, 2) + max(forces, 2)


class _Axis:
    """The nodes of one axis, and which of them must enclose the scene."""

    def __init__(self, nodes: Floats, asked: Range) -> None:
        inside = np.flatnonzero(enclosing(nodes, asked))
        first, last = int(inside[0]), int(inside[-1])
        self._single = asked[0] == asked[1]
        self.starts = list(range(first, -1, -1))
        self.ends = list(range(last, nodes.size))
        self.inner = list(range(first + 1, last))
        self.least = 1 if self._single else 2

    def size_of(self, nodes: Nodes) -> int:
        """How many values are left once the axis is cut off at the scene's ends."""
        return 1 if self._single else max(len(nodes), 2)

    def choices(self, viable: Callable[[Segment], bool]) -> Iterator[Nodes]:
        """All choices of nodes that enclose the scene by viable segments, smallest first."""
        for start in self.starts:
            if start in self.ends and viable((start, start)):
                yield (start,)
        good = cache(viable)
        paths: list[Nodes] = [(start,) for start in self.starts]
        while paths:
            yield from (
                (*path, end) for path in paths for end in self.ends if good((path[-1], end))
            )
            paths = [
                (*path, node)
                for path in paths
                for node in self.inner
                if path[-1] < node and good((path[-1], node))
            ]

    def shortest(self, good: Container[Segment]) -> Nodes | None:
        """The fewest nodes, all segments between which are good; None where there are none."""
        for node in self.starts:
            if node in self.ends and (node, node) in good:
                return (node,)
        paths: dict[int, Nodes] = {start: (start,) for start in self.starts}
        found: list[Nodes] = []
        for node in [*self.inner, *self.ends]:
            reached = [path for last, path in paths.items() if last < node and (last, node) in good]
            if not reached:
                continue
            path = (*min(reached, key=len), node)
            if node in self.ends:
                found.append(path)
            else:
                paths[node] = path
        return min(found, key=len, default=None)


class _Cells:
    """Which cells keep the bound: all that do so in their middle, until they are looked at."""

    def __init__(self, maps: ErrorMaps, places: Places, *, bound: Bound, taken: Errors) -> None:
        self._maps, self._bound, self._taken = maps, bound, taken
        self._counts = places.counts.ravel()
        self._likely: dict[Segment, set[Segment]] = {}

    def columns(self, rows: Sequence[Segment]) -> set[Segment]:
        """The segments of forces with which all of these segments of speeds seem good."""
        return set[Segment].intersection(*(self._columns(row) for row in rows))

    def are_good(self, rows: Sequence[Segment], columns: Sequence[Segment]) -> bool:
        """Whether cells are good everywhere; those that are not seem so no longer."""
        good = True
        for row in rows:
            for column, cell in zip(columns, self._maps.cells(row, columns), strict=True):
                if not self._kept(*cell).all():
                    self._likely[row].discard(column)
                    good = False
        return good

    def _columns(self, row: Segment) -> set[Segment]:
        if row not in self._likely:
            kept = self._kept(*self._maps.centres(row))
            segments = zip(self._maps.column_segments, kept, strict=True)
            self._likely[row] = {segment for segment, good in segments if good}
        return self._likely[row]

    def _kept(self, places: Integers, errors: Errors) -> Bools:
        """Where the bound is kept, or does not count."""
        within = errors.within(self._bound, taken=self._taken.at(places))
        kept: Bools = within | ~self._counts[places]
        return kept
