"""The fewest nodes of a table between which blending linearly keeps a bound.

docs/method/scenes.md#fewest-nodes

An error in a cell depends on its four corners alone, so that a choice of speeds and of forces is
good where each of its cells is. Choices of speeds grow node by node; each knows the segments of
forces with which all its cells are good, and the fewest forces are a shortest path through these.
What can no longer become the smallest is dropped: a choice that ends at the same node as another
one which is no longer and leaves no fewer segments, and one that is too long already. The result is
the smallest of all.
"""

from __future__ import annotations

from itertools import compress
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.scenes.error_maps import ErrorMaps, Segment, segments_of
from tactileq.modeling.scenes.hands import Range
from tactileq.modeling.scenes.measures import Errors
from tactileq.modeling.scenes.places import Places, enclosing
from tactileq.modeling.scenes.scene import Bound

Nodes = tuple[int, ...]
NO_LIMIT = 2**62


def fewest_nodes(
    maps: ErrorMaps, places: Places, *, bound: Bound, taken: Errors, below: int = NO_LIMIT
) -> tuple[Nodes, Nodes] | None:
    """Speeds and forces of a table, as indices, that keep a bound with the fewest numbers.

    Parameters
    ----------
    places : Places
        Where the bound counts.
    taken : Errors
        What of it is taken already at each node, (P,).
    below : int
        How many numbers (`table_numbers`) are too many.

    Returns
    -------
    two tuples of int, or None
        The first may be below the scene and the last above it. None where what is taken breaks the
        bound, or where it takes too many numbers.
    """
    search = _Search(maps, places, bound=bound, taken=taken, below=below)
    while True:  # cells that only seem good are struck out, until none is left among the chosen
        found = search.smallest()
        if found is None or search.are_good(*found):
            return found


def table_numbers(speeds: int, forces: int, layers: int) -> int:
    """Of a table with these axes; one of a single value is stored twice."""
    speeds, forces = max(speeds, 2), max(forces, 2)
    return speeds * forces * (1 + 3 * layers) + speeds + forces


class _Choice(NamedTuple):
    """Speeds from below the scene up to some node, and the segments of forces that are left."""

    nodes: Nodes
    columns: int  # a bit for each segment


class _Axis:
    """The nodes of one axis, and which of them must enclose the scene."""

    def __init__(self, nodes: Floats, asked: Range) -> None:
        inside = np.flatnonzero(enclosing(nodes, asked))
        first, last = int(inside[0]), int(inside[-1])
        self._single = asked[0] == asked[1]
        self.starts = list(range(first, -1, -1))
        self.ends = list(range(last, nodes.size))
        self.inner = list(range(first + 1, last))

    def size_of(self, nodes: int) -> int:
        """How many values are left of so many once the axis is cut off at the scene's ends."""
        return 1 if self._single else max(nodes, 2)


class _Search:
    """The smallest choice of nodes, as far as it is known which cells are good."""

    def __init__(
        self, maps: ErrorMaps, places: Places, *, bound: Bound, taken: Errors, below: int
    ) -> None:
        self._maps, self._bound, self._taken, self._below = maps, bound, taken, below
        self._counts = places.counts.ravel()
        self._speeds = _Axis(places.speeds_mm_s, places.speed_range)
        self._forces = _Axis(places.forces_n, places.force_range)
        self._bits = {s: 1 << bit for bit, s in enumerate(maps.column_segments)}
        self._every = (1 << len(self._bits)) - 1
        self._likely: dict[Segment, int] = {}
        self._paths: dict[int, Nodes | None] = {}

    def smallest(self) -> tuple[Nodes, Nodes] | None:
        """The fewest numbers with which all cells seem good."""
        best: tuple[Nodes, Nodes] | None = None
        least = self._below
        growing = [_Choice((node,), self._every) for node in self._speeds.starts]
        kept: dict[int, list[int]] = {}
        whole = [
            _Choice((node,), self._columns((node, node)))
            for node in self._speeds.starts
            if node in self._speeds.ends
        ]
        while growing or whole:
            ended = [*whole, *self._longer(growing, self._speeds.ends)]
            for choice in ended:
                numbers, forces = self._fewest(choice)
                if forces is not None and numbers < least:
                    best, least = (choice.nodes, forces), numbers
            longer, whole = self._longer(growing, self._speeds.inner), []
            growing = [each for each in longer if self._may_win(each, kept, least=least)]
        return best

    def _longer(self, choices: list[_Choice], nodes: list[int]) -> list[_Choice]:
        return [
            _Choice((*choice.nodes, node), choice.columns & self._columns((choice.nodes[-1], node)))
            for choice in choices
            for node in nodes
            if node > choice.nodes[-1]
        ]

    def _may_win(self, choice: _Choice, kept: dict[int, list[int]], *, least: int) -> bool:
        """Whether a choice could, with one more speed, be the smallest: no other one beats it."""
        numbers, _ = self._fewest(choice, more=1)
        others = kept.setdefault(choice.nodes[-1], [])
        if numbers >= least or any(choice.columns & ~other == 0 for other in others):
            return False
        others.append(choice.columns)
        return True

    def _fewest(self, choice: _Choice, *, more: int = 0) -> tuple[int, Nodes | None]:
        """The fewest forces for a choice of speeds, and the numbers with so many more speeds."""
        forces = self._fewest_forces(choice.columns)
        if forces is None:
            return NO_LIMIT, None
        return self._numbers(len(choice.nodes) + more, forces), forces

    def _numbers(self, speeds: int, forces: Nodes) -> int:
        sizes = self._speeds.size_of(speeds), self._forces.size_of(len(forces))
        return table_numbers(*sizes, self._maps.model.n_layers)

    def _fewest_forces(self, columns: int) -> Nodes | None:
        """A shortest path through segments of forces that encloses the scene; None without any."""
        if columns not in self._paths:
            self._paths[columns] = self._shortest(columns)
        return self._paths[columns]

    def _shortest(self, columns: int) -> Nodes | None:
        axis, bits = self._forces, self._bits
        for node in axis.starts:
            if node in axis.ends and columns & bits[node, node]:
                return (node,)
        paths: dict[int, Nodes] = {start: (start,) for start in axis.starts}
        found: list[Nodes] = []
        for node in [*axis.inner, *axis.ends]:
            reached = [
                path for last, path in paths.items() if last < node and columns & bits[last, node]
            ]
            if not reached:
                continue
            path = (*min(reached, key=len), node)
            if node in axis.ends:
                found.append(path)
            else:
                paths[node] = path
        return min(found, key=len, default=None)

    # --- Cells

    def _columns(self, row: Segment) -> int:
        """The segments of forces with which a segment of speeds seems good."""
        if row not in self._likely:
            kept = self._kept(*self._maps.centres(row))
            self._likely[row] = sum(compress(self._bits.values(), kept))
        return self._likely[row]

    def are_good(self, speeds: Nodes, forces: Nodes) -> bool:
        """Whether all cells are good everywhere; those that are not seem so no longer."""
        good = True
        columns = segments_of(forces)
        for row in segments_of(speeds):
            for column, cell in zip(columns, self._maps.cells(row, columns), strict=True):
                if not self._kept(*cell).all():
                    self._likely[row] &= ~self._bits[column]
                    good = False
        return good

    def _kept(self, places: Integers, errors: Errors) -> Bools:
        """Where the bound is kept, or does not count."""
        within = errors.within(self._bound, taken=self._taken.at(places))
        kept: Bools = within | ~self._counts[places]
        return kept
