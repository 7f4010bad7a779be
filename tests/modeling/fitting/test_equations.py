"""Records anywhere in the cells of a lattice: the coupled equations are the dense ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.equations import (
    STEPS,
    Blocks,
    Corners,
    band_of,
    cells,
    corners_of,
    of_cells,
    rows_of,
    solve_blocks,
)

SHAPES = [(1, 1), (4, 1), (2, 2), (3, 2), (4, 3), (5, 5)]


def placed(rows: int, columns: int, records: int, seed: int) -> tuple[Corners, Floats]:
    """Random places in a lattice with uneven axes, some beyond it."""
    rng = np.random.default_rng(seed)
    axes = np.cumsum(rng.uniform(0.1, 1.0, rows)), np.cumsum(rng.uniform(0.1, 1.0, columns))
    places = np.column_stack([rng.uniform(a[0] - 0.2, a[-1] + 0.2, records) for a in axes])
    return corners_of(places, axes), places


def positive(count: int, p: int, seed: int) -> Floats:
    root = np.random.default_rng(seed).standard_normal((count, p, p))
    return root @ root.transpose(0, 2, 1) + 0.1 * np.eye(p)


def dense(blocks: Blocks, columns: int) -> Floats:
    """The whole matrix, block by block from its definition."""
    count, p = blocks.own.shape[:2]
    matrix = np.zeros((count, p, count, p))
    for coupling, (down, across) in zip(blocks, STEPS, strict=True):
        for node in range(count):
            row, column = divmod(node, columns)
            there = row + down < count // columns and 0 <= column + across < columns
            if coupling is None or not there:
                continue
            other = node + down * columns + across
            matrix[node, :, other] = coupling[node]
            matrix[other, :, node] = coupling[node].T
    return matrix.reshape(count * p, count * p)


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
def test_information_on_places_is_that_of_their_blends(rows: int, columns: int) -> None:
    corners, _ = placed(rows, columns, 17, seed=rows + columns)
    information = positive(17, 3, seed=1)
    found = dense(corners.coupled(information), columns)
    wide = np.kron(corners.weights, np.eye(3)).reshape(17, 3, -1)
    expected = np.einsum("kpx,kpq,kqy->xy", wide, information, wide)
    assert found == pytest.approx(expected, abs=1e-12)
    theta = np.random.default_rng(2).standard_normal((rows * columns, 3))
    assert corners.blended(theta) == pytest.approx(corners.weights @ theta)
    assert corners.gathered(information[:, 0]) == pytest.approx(
        corners.weights.T @ information[:, 0]
    )


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
def test_coupled_equations_are_solved_as_the_dense_ones(rows: int, columns: int) -> None:
    corners, _ = placed(rows, columns, 30, seed=3)
    blocks = corners.coupled(positive(30, 4, seed=4))
    blocks = blocks._replace(own=blocks.own + np.eye(4))
    matrix = dense(blocks, columns)
    right = np.random.default_rng(5).standard_normal((rows * columns, 4))
    expected = np.linalg.solve(matrix, right.ravel())
    assert solve_blocks(blocks, right, columns=columns).ravel() == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )
    band = band_of(blocks, columns=columns)
    for offset in range(min(len(band), len(matrix))):
        line = np.diagonal(matrix, -offset)
        assert band[offset, : line.size] == pytest.approx(line, abs=1e-12)


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
def test_rows_of_nodes_make_up_the_matrix(rows: int, columns: int) -> None:
    corners, _ = placed(rows, columns, 25, seed=6)
    blocks = corners.coupled(positive(25, 2, seed=7))
    size = 2 * columns
    matrix = np.zeros((rows * size, rows * size))
    for row, (own, after) in enumerate(rows_of(blocks, columns=columns)):
        here = slice(row * size, (row + 1) * size)
        matrix[here, here] = own
        if row + 1 < rows:
            below = slice((row + 1) * size, (row + 2) * size)
            matrix[here, below], matrix[below, here] = after, after.T
    assert matrix == pytest.approx(dense(blocks, columns), abs=1e-12)


def test_matrices_of_cells_add_up() -> None:
    nodes = cells(4, 3)
    assert nodes.shape == (6, 4)
    root = np.random.default_rng(8).standard_normal((6, 8, 8))
    whole = root @ root.transpose(0, 2, 1)
    found = dense(of_cells(nodes, whole.reshape(6, 4, 2, 4, 2), 12), 3)
    expected = np.zeros((12, 2, 12, 2))
    for cell, corners in zip(whole.reshape(6, 4, 2, 4, 2), nodes, strict=True):
        for a, one in enumerate(corners):
            for b, other in enumerate(corners):
                expected[one, :, other] += cell[a, :, b]
    assert found == pytest.approx(expected.reshape(24, 24), abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(SHAPES), st.integers(0, 1000))
def test_blends_are_bilinear_and_held_at_the_edge(shape: tuple[int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    axes = tuple(np.cumsum(rng.uniform(0.1, 1.0, n)) for n in shape)
    places = np.column_stack([rng.uniform(a[0] - 0.5, a[-1] + 0.5, 9) for a in axes])
    corners = corners_of(places, (axes[0], axes[1]))
    inside = np.column_stack([np.clip(p, a[0], a[-1]) for p, a in zip(places.T, axes, strict=True)])
    at_nodes = np.array([(x, y, x * y) for x in axes[0] for y in axes[1]])
    expected = np.column_stack((inside, inside.prod(axis=1)))
    assert corners.blended(at_nodes) == pytest.approx(expected, abs=1e-9)
    assert corners.weights.sum(axis=1) == pytest.approx(1.0)


def test_places_at_the_nodes_are_the_nodes() -> None:
    axes = np.log([50.0, 110.0, 350.0]), np.log([0.5, 3.5])
    nodes = np.array([(x, y) for x in axes[0] for y in axes[1]])
    assert corners_of(nodes, axes).are_nodes
    assert not corners_of(nodes[::-1], axes).are_nodes
