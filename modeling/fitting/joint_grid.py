"""The `joint` estimator over a whole grid: the layers of a texture as one smooth field.

Of the solutions that the search has found the nearest is taken, by the distance that is expected
from the true spectra at and between the conditions, with as few layers as are worth it. The field
learns its own smoothness from the texture.
docs/method/fitting.md#smooth-field, docs/method/fitting.md#model-choice
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import counted
from tactileq.modeling.estimation.coherent import (
    level_deviations,
    misfits,
    record_information,
    response,
    without_layer,
)
from tactileq.modeling.estimation.layers import Layers
from tactileq.modeling.estimation.likelihood import NEPER_DB, split
from tactileq.modeling.fitting.blending import distances_db
from tactileq.modeling.fitting.equations import Blocks
from tactileq.modeling.fitting.field import (
    Covariances,
    covariances,
    solve,
)
from tactileq.modeling.fitting.layer_search import (
    MOST_LAYERS,
    Solution,
    completed,
    fitted,
    in_frequency_order,
    learned,
    search,
    search_precision,
)
from tactileq.modeling.fitting.texture_grid import TextureGrid, texture_grid
from tactileq.modeling.models.fit_summary import FitSummary
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.recordings.spectrum import Spectrum

# What doubling does: see `layer_search`. Where nothing is said, nothing changed there.
EM_ROUNDS = 3  # doubled: ±1 % on single surfaces, 1.3 times the time
# A blend that is farther than this from the mean of its nodes, as a distance over frequency, has
# collapsed: of 98 models of real surfaces 95 stay below 3.4 dB, and three that lose their level
# between conditions are above 13.
LARGEST_DEFECT_DB = 4.0
# What further layers must bring somewhere, and in how large a share of the records.
LEAST_WORTH_DB, SOMEWHERE = 0.1, 0.1
# In log likelihood: what the expected losses of two models must differ by to differ at all, since
# the best of several hundred places gains much by chance. Chosen on 40 textures each with a white
# floor, records of 0.25 s and hum (seeds 5000 to 5039), and on 120 drawn surfaces (3000 to 3119).
# Doubled: +2 %, worst +14 %, two layers fewer.
LEAST_DIFFERENCE = 20.0
# Beyond scatter, as a distance from the records: then the search goes on. Of 12 drawn surfaces none
# is left with so much, of 12 altered ones 8 (seeds 3000 to 3011).
MUCH_UNEXPLAINED_DB = 0.5
STRAIGHT = 30.0  # times the field's stiffness while searching
LARGEST_LEVEL_SD_DB = 12.0
# A record that leaves more than this of the variance with which its neighbours predict a
# frequency has not determined it.
INHERITED_SHARE = 0.5
# In log likelihood: what a record must lose without a layer, to show a peak of it. Doubled: worst
# +4 %.
LEAST_EVIDENCE = 3.0
# Layers within this share of their widths, of opposite signs, are tried as one.
CANCELLING_SHARE = 0.25
LEAST_LEFT = 0.05
REFIT_ROUNDS = 2
LEAST_START = 1e-6
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
    summary : FitSummary, optional
        Of what is not silent.
    """

    layers: dict[Condition, Layers]
    inherited: dict[Condition, Bools]
    recorded: dict[Condition, bool]
    summary: FitSummary | None = None


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
    contenders, refused = _held(grid, count)
    if count is None:
        contenders = _with_further(grid, contenders)
    best = in_frequency_order(grid, _with_fewest(grid, contenders))
    solution = _straightened(grid, learned(grid, best.theta, best.signs, rounds=EM_ROUNDS))
    if count is None:
        solution = _merged(grid, _completed(grid, solution))
    summary = _summary(grid, solution, contenders, refused=refused)
    return replace(_grid_fit(grid, solution), summary=summary)


def _summary(
    grid: TextureGrid, solution: Solution, contenders: Sequence[Solution], *, refused: bool
) -> FitSummary:
    others = _nearest_by_count(contenders)
    by_layers = {m: found.distance_db for m, found in others.items() if m != solution.count}
    warnings = [
        f"the recording at {speed:.4g} mm/s and {force:.3g} N is {abs(level):.0f} dB "
        f"{'louder' if level > 0 else 'softer'} than the others suggest; its level was left out of "
        "the model, check its gain or record it again"
        for (speed, force), level in grid.surprising()
    ]
    if refused:
        warnings.append(
            f"with more than {counted(solution.count, 'layer')} the response between conditions "
            f"lies over {LARGEST_DEFECT_DB:g} dB from what its conditions suggest; fewer layers "
            "were taken"
        )
    if not _holds(solution):
        warnings.append(
            f"between conditions the response lies {solution.blend_defect_db:.1f} dB from what its "
            f"conditions suggest (at most {LARGEST_DEFECT_DB:g} dB is usual); do not use the model "
            "between its conditions"
        )
    if grid.scattered is not None:
        warnings.append(
            f"{grid.recorded.sum()} scattered conditions: the model is a smooth field over "
            f"{len({v for v, _ in grid.conditions})} speeds × "
            f"{len({f for _, f in grid.conditions})} forces, not the conditions themselves"
        )
    return FitSummary(
        solution.at_db,
        solution.blend_defect_db,
        solution.distance_db,
        {str(m): by_layers[m] for m in sorted(by_layers)},
        tuple(warnings),
    )


def refit_grid_jointly(spectra: Mapping[Condition, Spectrum], model: TextureModel) -> GridFit:
    """The layers of a model, their number and signs as in it, fitted to other records.

    Parameters
    ----------
    spectra : mapping of (speed, force) to Spectrum
        Of the same texture and rate, at least one that is not silent.
    model : TextureModel
        By `joint`.
    """
    grid = texture_grid(spectra)
    at = model.parameters(*np.array(grid.conditions).T)
    signs = np.where(np.median(model.gains, axis=(0, 1)) < 0, -1.0, 1.0)
    gains = np.column_stack((at.noise_gain, at.gains * signs)) / grid.scale
    gains = np.log(np.maximum(gains, LEAST_START))
    places = np.log(np.hstack((at.frequencies_hz, at.bandwidths_hz)))
    theta = np.hstack((gains[:, :1], places, gains[:, 1:]))
    solution = learned(grid, theta, signs, rounds=REFIT_ROUNDS)
    return _grid_fit(grid, solution)


def _held(grid: TextureGrid, count: int | None) -> tuple[list[Solution], bool]:
    """Contenders whose blends hold, and whether all of the number asked for were refused.

    Where none of them does fewer layers are searched; white noise alone always holds.
    """
    contenders = search(grid, count=count)
    held = [found for found in contenders if _holds(found)]
    fewest = min(found.count for found in contenders)
    if held or not fewest:
        return held or contenders, False
    return _held(grid, fewest - 1)[0], True


def _holds(solution: Solution) -> bool:
    """Whether no blend has collapsed."""
    return solution.blend_defect_db <= LARGEST_DEFECT_DB


def _with_further(grid: TextureGrid, contenders: list[Solution]) -> list[Solution]:
    """The contenders; also with one and two layers more where the nearest leaves much unexplained.

    Crossing peaks may stop the search early.
    """
    nearest = min(contenders, key=lambda found: found.distance_db)
    if nearest.unexplained_db <= MUCH_UNEXPLAINED_DB:
        return contenders
    counts = [nearest.count + more for more in (1, 2) if nearest.count + more <= MOST_LAYERS]
    further = [found for count in counts for found in search(grid, count=count)]
    return contenders + [found for found in further if _holds(found)]


def _straightened(grid: TextureGrid, solution: Solution) -> Solution:
    """The solution, or one begun from a stiff field where much is unexplained.

    Layers that change places between two nodes bend the field there; a stiff one has none that do.
    """
    if solution.unexplained_db <= MUCH_UNEXPLAINED_DB:
        return solution
    precision = STRAIGHT * search_precision(solution.count)
    start = fitted(grid, solution.theta, solution.signs, precision=precision, middles=True)
    straight = learned(grid, start.theta, start.signs, rounds=EM_ROUNDS)
    return min(solution, straight, key=lambda found: found.distance_db)


def _with_fewest(grid: TextureGrid, contenders: Sequence[Solution]) -> Solution:
    """The nearest contender, or one with fewer layers where further ones are worth nothing."""
    best = _nearest_by_count(contenders)
    nearest = min(best.values(), key=lambda found: found.distance_db)
    for count in sorted(best):
        if count == nearest.count or not _worth(grid, nearest, fewer=best[count]):
            return best[count]
    return nearest


def _nearest_by_count(contenders: Sequence[Solution]) -> dict[int, Solution]:
    best: dict[int, Solution] = {}
    for found in sorted(contenders, key=lambda found: found.distance_db, reverse=True):
        best[found.count] = found
    return best


def _worth(grid: TextureGrid, more: Solution, *, fewer: Solution) -> bool:
    """Whether further layers bring a model nearer, by 0.1 dB somewhere.

    Somewhere: all in all, or in a tenth of the records, by what the layers change there.
    """
    differ = fewer.lost - more.lost >= LEAST_DIFFERENCE
    at_db = more.at_db if differ else max(more.at_db, fewer.at_db)
    gained = fewer.distance_db - float(np.hypot(at_db, more.between_db))
    if gained >= LEAST_WORTH_DB or gained <= 0 or not differ:
        return gained >= LEAST_WORTH_DB
    one, other = (_levels(grid, found)[grid.recorded] for found in (more, fewer))
    changed = distances_db(one, other, grid.sampled)
    worth = np.hypot(more.distance_db, changed) - more.distance_db
    return bool(np.quantile(worth, 1 - SOMEWHERE) >= LEAST_WORTH_DB)


def _levels(grid: TextureGrid, solution: Solution) -> Floats:
    """The response of each record in nepers, (K, n), at the frequencies that are compared."""
    at, rows = solution.fit.at_records, np.zeros(len(grid.powers), dtype=np.intp)
    return np.asarray(0.5 * np.log(response(at, solution.signs, grid.sampled.rows(rows)).power))


def _completed(grid: TextureGrid, solution: Solution) -> Solution:
    """The solution, or one with further layers that some record clearly lacks."""
    more = completed(grid, solution)
    if more is solution:
        return solution
    more = learned(grid, more.theta, more.signs, rounds=EM_ROUNDS)
    return more if _holds(more) and _worth(grid, more, fewer=solution) else solution


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
        near = fitted(grid, *start)
        one = learned(grid, near.theta, near.signs, rounds=EM_ROUNDS)
        if one.distance_db > solution.distance_db:
            return solution
        solution = one
    return solution


def _cancelling_pair(grid: TextureGrid, solution: Solution) -> tuple[int, int] | None:
    """Two layers (the louder one first) of opposite signs at one place in most conditions."""
    _, frequency, bandwidth, gain = (np.exp(part) for part in split(solution.theta, solution.count))
    known = grid.known
    for a, b in combinations(range(solution.count), 2):
        near = CANCELLING_SHARE * np.minimum(bandwidth[:, a], bandwidth[:, b])
        together = np.abs(frequency[:, a] - frequency[:, b]) < near
        if solution.signs[a] != solution.signs[b] and together[known].mean() > 0.5:
            louder = (gain[:, a] > gain[:, b])[known].mean() >= 0.5
            return (a, b) if louder else (b, a)
    return None


def _grid_fit(grid: TextureGrid, solution: Solution) -> GridFit:
    """Layers in the order of their frequencies in the top corner, with their deviations."""
    m, recorded = solution.count, grid.known
    absent = _absent(grid, solution)
    theta = np.clip(_placed_by_neighbours(solution, absent), *grid.limits(m))
    noise, frequency, bandwidth, gain = split(theta, m)
    top = max(range(len(theta)), key=lambda row: grid.conditions[row])
    order = np.argsort(frequency[top], kind="stable")
    at_records = grid.corners.blended(theta)
    records = record_information(at_records, solution.signs, solution.observed)
    information = grid.corners.coupled(records)
    after = covariances(solution.fit.field, information)
    level_sd = level_deviations(theta, after.conditions, rate_hz=grid.rate_hz)
    inherited = absent | _determined_by_neighbours(after, information.own, m)
    width = np.exp(bandwidth)
    step = np.where(grid.near, grid.steps_hz[:, None], grid.step_hz).max(axis=0)
    unresolved = recorded[:, None] & (absent | (width < 2 * step[:, None]))
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
        dict(zip(grid.conditions, recorded.tolist(), strict=True)),
    )


def _absent(grid: TextureGrid, solution: Solution) -> Bools:
    """Where no record shows much of a layer, (N, m): without it they are as likely there."""
    m, theta = solution.count, solution.fit.at_records
    shown = np.zeros((len(theta), m), dtype=bool)
    for layer in range(m):
        without = theta.copy()
        without[:, 1 + 2 * m + layer] -= FADED
        power = response(without, solution.signs, solution.observed).power
        cost = misfits(power, solution.observed) - solution.fit.slopes.misfit
        shown[:, layer] = cost >= LEAST_EVIDENCE
    near = grid.near.astype(float).T
    return np.asarray((near @ shown == 0) & grid.known[:, None])


def _placed_by_neighbours(solution: Solution, absent: Bools) -> Floats:
    """Parameters (N, p) with absent layers where their neighbours predict them.

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
    """Where the neighbours determine a layer's frequency rather than the records, (N, m)."""
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
