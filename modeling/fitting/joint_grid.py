"""The `joint` estimator over a whole grid: the layers of a texture as one smooth field.

Of the solutions that the search has found the likeliest is taken: by its evidence, so that a layer
must say more than the freedom to say it costs, and by how well it predicts conditions that are
hidden from it. Then the field learns its own smoothness from the texture
docs/method/fitting.md#smooth-field, docs/method/fitting.md#model-choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from modeling.arrays import Bools, Floats
from modeling.estimation.coherent import (
    level_deviations,
    misfits,
    record_information,
    response,
    without_layer,
)
from modeling.estimation.joint import NEPER_DB
from modeling.estimation.layers import Layers
from modeling.estimation.likelihood import split
from modeling.fitting.equations import Blocks
from modeling.fitting.field import (
    Covariances,
    covariances,
    solve,
)
from modeling.fitting.layer_search import (
    LEAST_GAIN,
    Solution,
    completed,
    fitted,
    in_frequency_order,
    learned,
    search,
)
from modeling.fitting.texture_grid import TextureGrid, texture_grid
from modeling.models.grid import Condition
from modeling.recordings.spectrum import Spectrum

EM_ROUNDS = 3
LARGEST_LEVEL_SD_DB = 12.0
# A record that leaves more than this of the variance with which its neighbours predict a
# frequency has not determined it.
INHERITED_SHARE = 0.5
# In log likelihood: what a record must lose without a layer, to show a peak of it.
LEAST_EVIDENCE = 3.0
# Layers within this share of their widths, of opposite signs, are tried as one.
CANCELLING_SHARE = 0.25
LEAST_LEFT = 0.05
FADED = 8.0  # of log amplitude: 70 dB
HELD = 1e8
TREND_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class GridFit:
    """Layers of every condition of the grid under common names.

    Parameters
    ----------
    layers : dict of (speed, force) to Layers
        Also of conditions without a record, as their neighbours predict them.
    inherited : dict of (speed, force) to (m,) ndarray of bool
        Layers whose frequency the neighbours determine rather than the record.
    recorded : dict of (speed, force) to bool
        Whether there is a record that is not silent.
    """

    layers: dict[Condition, Layers]
    inherited: dict[Condition, Bools]
    recorded: dict[Condition, bool]


def fit_grid_jointly(spectra: Mapping[Condition, Spectrum], *, count: int | None = None) -> GridFit:
    """Layers of one texture over its grid, by their frequencies in the top corner.

    Parameters
    ----------
    spectra : mapping of (speed, force) to Spectrum
        One texture, at least one condition. A silent one counts as not recorded.
    count : int, optional
        Number of layers; chosen without it.
    """
    grid = texture_grid(spectra)
    if not grid.recorded.any():
        return _silent(grid)
    best = min(search(grid, count=count), key=lambda found: found.distance_db)
    best = in_frequency_order(grid, completed(grid, best, count=count))
    solution = learned(grid, best, rounds=EM_ROUNDS)
    if count is None:
        solution = _merged(grid, solution)
    return _grid_fit(grid, solution)


def _merged(grid: TextureGrid, solution: Solution) -> Solution:
    """The solution without layers that another, of the opposite sign, mostly cancels.

    Two of them at one place can say what one would, and vanish where it would have to change more
    than a field may; but what is left of them is determined by their difference alone.
    """
    while (pair := _cancelling_pair(grid, solution)) is not None:
        stays, goes = pair
        m, theta = solution.count, solution.theta.copy()
        gain = 1 + 2 * m
        amplitude = np.exp(theta[:, gain + stays]) - np.exp(theta[:, gain + goes])
        least = LEAST_LEFT * np.exp(theta[:, gain + stays])
        theta[:, gain + stays] = np.log(np.maximum(amplitude, least))
        start = without_layer(theta, goes), np.delete(solution.signs, goes)
        one = learned(grid, fitted(grid, *start), rounds=EM_ROUNDS)
        if one.distance_db > solution.distance_db:
            return solution
        solution = one
    return solution


def _cancelling_pair(grid: TextureGrid, solution: Solution) -> tuple[int, int] | None:
    """Two layers (the louder one first) of opposite signs at one place in most conditions."""
    _, frequency, bandwidth, gain = (np.exp(part) for part in split(solution.theta, solution.count))
    for a, b in combinations(range(solution.count), 2):
        near = CANCELLING_SHARE * np.minimum(bandwidth[:, a], bandwidth[:, b])
        together = np.abs(frequency[:, a] - frequency[:, b]) < near
        if solution.signs[a] != solution.signs[b] and together[grid.recorded].mean() > 0.5:
            louder = (gain[:, a] > gain[:, b])[grid.recorded].mean() >= 0.5
            return (a, b) if louder else (b, a)
    return None


def _grid_fit(grid: TextureGrid, solution: Solution) -> GridFit:
    """Layers in the order of their frequencies in the top corner, with their deviations."""
    m = solution.count
    absent = _absent(grid, solution)
    theta = np.clip(_placed_by_neighbours(solution, absent), *grid.limits(m))
    noise, frequency, bandwidth, gain = split(theta, m)
    top = max(range(len(theta)), key=lambda row: grid.conditions[row])
    order = np.argsort(frequency[top], kind="stable")
    records = record_information(theta, solution.signs, solution.observed)
    after = covariances(solution.fit.field, Blocks(records))
    level_sd = level_deviations(theta, after.conditions, rate_hz=grid.rate_hz)
    inherited = absent | _determined_by_neighbours(after, records, m)
    width = np.exp(bandwidth)
    unresolved = grid.recorded[:, None] & (absent | (width < 2 * grid.steps_hz[:, None]))
    gains = grid.scale * solution.signs * np.exp(gain)
    layers = {
        condition: Layers(
            grid.scale * float(np.exp(noise[row, 0])),
            np.exp(frequency[row])[order],
            width[row][order],
            gains[row][order],
            np.minimum(NEPER_DB * level_sd[row], LARGEST_LEVEL_SD_DB)[order],
            unresolved[row][order],
        )
        for row, condition in enumerate(grid.conditions)
    }
    return GridFit(
        layers,
        {c: inherited[row][order] for row, c in enumerate(grid.conditions)},
        dict(zip(grid.conditions, grid.recorded.tolist(), strict=True)),
    )


def _absent(grid: TextureGrid, solution: Solution) -> Bools:
    """Where a record hardly shows a layer, (C, m): without it there it is as likely."""
    m, theta = solution.count, solution.theta
    absent = np.zeros((len(theta), m), dtype=bool)
    for layer in range(m):
        without = theta.copy()
        without[:, 1 + 2 * m + layer] -= FADED
        power = response(without, solution.signs, solution.observed).power
        cost = misfits(power, solution.observed) - solution.fit.slopes.misfit
        absent[:, layer] = grid.recorded & (cost < LEAST_EVIDENCE)
    return absent


def _placed_by_neighbours(solution: Solution, absent: Bools) -> Floats:
    """Parameters (C, p) with absent layers where their neighbours predict them.

    Frequencies and widths that a record has read into its own scatter would mislead between the
    conditions.
    """
    m, field = solution.count, solution.fit.field
    if not absent.any():
        return solution.theta
    undetermined = np.zeros(solution.theta.shape, dtype=bool)
    # Of a layer that no record shows nothing is predicted.
    undetermined[:, 1 : 1 + m] = undetermined[:, 1 + m : 1 + 2 * m] = absent & ~absent.all(axis=0)
    # Each parameter by itself: a layer that vanishes must not pull its frequency along.
    alone = replace(field, precision=np.diag(np.diag(field.precision)))
    held = np.where(undetermined, 0.0, HELD)
    blocks = held[:, :, None] * np.eye(held.shape[1])
    theta = solution.theta
    for _ in range(TREND_ROUNDS):  # the trend is that of the layers that are shown
        trend = alone.places @ alone.trend
        rest = solve(alone, Blocks(blocks), held * (solution.theta - trend))
        theta = np.where(undetermined, rest + trend, solution.theta)
        alone = alone.following(theta)
    return theta


def _determined_by_neighbours(after: Covariances, records: Floats, m: int) -> Bools:
    """Where the neighbours determine a layer's frequency rather than the record, (C, m)."""
    own = np.eye(records.shape[1]) - after.conditions @ records
    before = np.linalg.solve(own + 1e-12 * np.eye(records.shape[1]), after.conditions)
    f = np.arange(1, 1 + m)
    left: Bools = after.conditions[:, f, f] > INHERITED_SHARE * np.abs(before[:, f, f])
    return left


def _silent(grid: TextureGrid) -> GridFit:
    none = np.zeros(0)
    nothing = Layers(0.0, none, none, none, none, none.astype(bool))
    return GridFit(
        dict.fromkeys(grid.conditions, nothing),
        dict.fromkeys(grid.conditions, none.astype(bool)),
        dict.fromkeys(grid.conditions, False),
    )
