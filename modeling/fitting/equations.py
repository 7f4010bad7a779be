"""Equations over a lattice of nodes: blocks that couple the corners of its cells, solved as bands.

A record lies in a cell of the lattice and is blended from the cell's four corners, so its
information couples them; so does a field whose neighbours change little. In rows of nodes all of it
is a block tridiagonal matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers

# (rows, columns) from a node to the one that a block couples it with; the corners of a cell are
# numbered row by row.
STEPS = ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1))
OWN, ACROSS, AGAINST, DOWN, ALONG = range(5)
_STEP_OF_CORNERS = {
    (0, 0): OWN,
    (1, 1): OWN,
    (2, 2): OWN,
    (3, 3): OWN,
    (0, 1): ACROSS,
    (2, 3): ACROSS,
    (1, 2): AGAINST,
    (0, 2): DOWN,
    (1, 3): DOWN,
    (0, 3): ALONG,
}
# The same for both corners' numbers, (4, 4); of no use where the first is the later one.
STEP_OF_CORNERS = np.array(
    [[_STEP_OF_CORNERS.get((a, b), OWN) for b in range(4)] for a in range(4)], dtype=np.intp
)


class Blocks(NamedTuple):
    """A symmetric matrix over N nodes with p parameters each.

    Each array (N, p, p) holds the blocks that couple a node (rows) with the one `STEPS` away
    (columns), by the node's number; None are zeros.
    """

    own: Floats
    across: Floats | None = None
    against: Floats | None = None
    down: Floats | None = None
    along: Floats | None = None

    def plus(self, other: Blocks) -> Blocks:
        """The sum of both."""
        couplings = [_sum(a, b) for a, b in zip(self[1:], other[1:], strict=True)]
        return Blocks(self.own + other.own, *couplings)


def _sum(a: Floats | None, b: Floats | None) -> Floats | None:
    if a is None or b is None:
        return b if a is None else a
    return a + b


@dataclass(frozen=True, eq=False)
class Corners:
    """Where K places lie in the cells of a lattice of N nodes, and how they are blended from them.

    Parameters
    ----------
    nodes : (K, 4) ndarray of int
        The corners of each place's cell, row by row.
    shares : (K, 4) ndarray
        Weights of bilinear interpolation; they sum to 1.
    count : int
        N.
    """

    nodes: Integers
    shares: Floats
    count: int

    @cached_property
    def are_nodes(self) -> bool:
        """Whether the places are the nodes themselves, in their order."""
        return bool(np.array_equal(self.weights, np.eye(self.count)))

    @cached_property
    def weights(self) -> Floats:
        """Weight of each node at each place, (K, N)."""
        return self._summed(self.nodes, self.shares).T

    @cached_property
    def _products(self) -> list[Floats]:
        """Per step, what the information of each place counts in each node's block, (N, K)."""
        products = [np.zeros((self.count, len(self.nodes))) for _ in STEPS]
        for (a, b), step in _STEP_OF_CORNERS.items():
            both = self.shares[:, a] * self.shares[:, b]
            products[step] += self._summed(self.nodes[:, a : a + 1], both[:, None])
        return products

    def _summed(self, nodes: Integers, shares: Floats) -> Floats:
        summed = np.zeros((self.count, len(nodes)))
        place = np.broadcast_to(np.arange(len(nodes))[:, None], nodes.shape)
        np.add.at(summed, (nodes, place), shares)
        return summed

    def blended(self, theta: Floats) -> Floats:
        """Parameters (K, p) at the places from those of the nodes (N, p)."""
        return theta if self.are_nodes else np.asarray(self.weights @ theta)

    def gathered(self, score: Floats) -> Floats:
        """Gradient (N, p) by the nodes' parameters from that by the places' (K, p)."""
        return score if self.are_nodes else np.asarray(self.weights.T @ score)

    def touched(self, places: Bools) -> Bools:
        """Nodes (N,) that any of these places (K,) is blended from."""
        return places if self.are_nodes else np.asarray(self.weights.T @ places > 0)

    def coupled(self, information: Floats) -> Blocks:
        """Information on the nodes from that on each place, (K, p, p)."""
        if self.are_nodes:
            return Blocks(information)
        flat = information.reshape(len(information), -1)
        shape = (self.count, *information.shape[1:])
        return Blocks(*((product @ flat).reshape(shape) for product in self._products))


def of_cells(nodes: Integers, blocks: Floats, count: int) -> Blocks:
    """The sum of matrices over the corners of cells.

    Parameters
    ----------
    nodes : (M, 4) ndarray of int
        Corners of M cells, none of them twice.
    blocks : (M, 4, p, 4, p) ndarray
    count : int
        Number of nodes.
    """
    p = blocks.shape[2]
    summed = np.zeros((len(STEPS), count, p, p))
    for a, b in combinations_with_replacement(range(4), 2):
        # No corner is the same one of two cells.
        summed[_STEP_OF_CORNERS[a, b], nodes[:, a]] += blocks[:, a, :, b]
    return Blocks(*summed)


def cells(rows: int, columns: int) -> Integers:
    """Corners (M, 4) of all cells; of a lattice of one column those of its gaps, twice each."""
    index = np.arange(rows * columns).reshape(rows, columns)
    if columns == 1:
        return np.column_stack((index[:-1], index[:-1], index[1:], index[1:]))
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    return np.stack([corner.ravel() for corner in corners], axis=1)


def corners_of(places: Floats, axes: tuple[Floats, Floats]) -> Corners:
    """Places (K, 2) in a lattice with these axes (rows, columns); beyond it those of its edge."""
    rows, row_share = _cell_of(places[:, 0], axes[0])
    columns, column_share = _cell_of(places[:, 1], axes[1])
    width = len(axes[1])
    below, beside = min(1, len(axes[0]) - 1) * width, min(1, width - 1)
    first = rows * width + columns
    nodes = np.stack((first, first + beside, first + below, first + below + beside), axis=1)
    shares = np.stack(
        (
            (1 - row_share) * (1 - column_share),
            (1 - row_share) * column_share,
            row_share * (1 - column_share),
            row_share * column_share,
        ),
        axis=1,
    )
    return Corners(nodes, shares, axes[0].size * width)


def _cell_of(values: Floats, axis: Floats) -> tuple[Integers, Floats]:
    if axis.size == 1:
        return np.zeros(values.size, dtype=np.intp), np.zeros(values.size)
    index = np.clip(np.searchsorted(axis, values, side="right") - 1, 0, axis.size - 2)
    share = (values - axis[index]) / (axis[index + 1] - axis[index])
    return index, np.clip(share, 0.0, 1.0)


def solve_blocks(blocks: Blocks, right: Floats, *, columns: int) -> Floats:
    """x (N, p) of blocks·x = right, by banded Cholesky factorisation.

    Parameters
    ----------
    blocks : Blocks
        Positive definite.
    right : (N, p) ndarray
    columns : int
        Nodes in a row.
    """
    from scipy.linalg.lapack import dpbsv  # what solveh_banded calls after several checks

    band = band_of(blocks, columns=columns)
    _, solution, info = dpbsv(band, right.ravel(), lower=1)
    if info:
        raise np.linalg.LinAlgError(f"leading minor {info} is not positive definite")
    return np.asarray(solution, dtype=np.float64).reshape(right.shape)


def band_of(blocks: Blocks, *, columns: int) -> Floats:
    """The lower band of a matrix, as SciPy's banded solvers read it."""
    count, p = blocks.own.shape[:2]
    reach = columns + 1 if blocks.along is None and blocks.against is None else columns + 2
    band = np.zeros(reach * p * count * p)
    places = _band_places(count, columns, p)
    band[places.diagonal] = blocks.own.reshape(count, -1)[:, places.lower]
    for step in range(1, len(STEPS)):
        coupling = blocks[step]
        if coupling is not None:
            nodes, where = places.coupled[step - 1]
            band[where] = coupling.reshape(count, -1)[nodes]
    return band.reshape(-1, count * p)[: count * p]


class _BandPlaces(NamedTuple):
    """Positions of blocks and couplings in the band, row by row.

    `lower` (t,) are the places of a block's lower triangle in the block, `diagonal` (N, t) those in
    the band; `coupled` those nodes that have a neighbour, and where its block goes.
    """

    lower: Integers
    diagonal: Integers
    coupled: tuple[tuple[Integers, Integers], ...]


@lru_cache(maxsize=64)
def _band_places(count: int, columns: int, p: int) -> _BandPlaces:
    width = count * p
    starts = np.arange(count) * p
    row, column = np.tril_indices(p)
    diagonal = (row - column) * width + starts[:, None] + column
    # A coupling's rows belong to the earlier node: the band below the diagonal holds its transpose.
    earlier, later = (index.ravel() for index in np.indices((p, p)))
    coupled = []
    for down, across in STEPS[1:]:
        nodes = np.flatnonzero(having(count, columns, down=down, across=across))
        far = down * columns + across
        where = (far * p + later - earlier) * width + starts[nodes][:, None] + earlier
        coupled.append((nodes, where))
    return _BandPlaces(row * p + column, diagonal, tuple(coupled))


def having(count: int, columns: int, *, down: int, across: int) -> Bools:
    """Which nodes have another one so many rows and columns away, (N,)."""
    row, column = np.divmod(np.arange(count), columns)
    there = (row + down < count // columns) & (column + across >= 0)
    return np.asarray(there & (column + across < columns))


def rows_of(blocks: Blocks, *, columns: int) -> Iterator[tuple[Floats, Floats]]:
    """Row by row of nodes: its own block, and the one that couples it with the next row.

    Both (columns·p, columns·p); after the last row there is no next one, and zeros come.
    """
    count, p = blocks.own.shape[:2]
    for row in range(count // columns):
        here, after = np.zeros((2, columns, p, columns, p))
        for step, (down, across) in enumerate(STEPS):
            coupling = blocks[step]
            if coupling is None:
                continue
            for column in range(max(0, -across), columns - max(0, across)):
                block = coupling[row * columns + column]
                if down:
                    after[column, :, column + across] = block
                else:
                    here[column, :, column + across] = block
                    here[column + across, :, column] = block.T
        size = columns * p
        yield here.reshape(size, size), after.reshape(size, size)
