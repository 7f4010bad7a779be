"""Layers over the whole grid at once: peaks of all conditions that follow one smooth law.

A layer's frequency changes with speed and force smoothly, often as a power of the speed (1 for a
spatial wavelength, 0 for a resonance). All peaks of all conditions vote for such laws; the
best-supported ones become the layers, whatever is missing or false in single conditions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modeling.grid import Condition
from modeling.likelihood import LOWEST_HZ
from modeling.peaks import Peaks
from modeling.peq import Floats

# From a square root outwards: of equal supports the first, so the less extreme, wins.
EXPONENTS = np.array(sorted(np.linspace(-0.3, 1.3, 33), key=lambda p: abs(p - 0.5)))
TOLERANCE = (0.05, 0.2)  # of log frequency; within them 0.6 of the relative bandwidth
# A law is a layer where the evidence of its peaks, each counting up to one, reaches this share of
# the conditions.
CLEAR_EVIDENCE = 40.0
LEAST_SUPPORT = 0.12
ROUNDS = 3
MERGING_DISTANCE = 3.0  # in tolerances
STRAYED_SPREADS = 5.0
RIDGE = (0.0, 0.1, 3.0, 3.0)
HELD = np.array([1.0, 1.0, 0.0, 0.0])  # of an old law: level and power of the speed


@dataclass(frozen=True, eq=False)
class Tracks:
    """m layers over C conditions.

    Parameters
    ----------
    chosen : (C, m) ndarray of int
        Index of the layer's peak among the condition's peaks, −1 where it has none.
    frequencies_hz, bandwidths_hz : (C, m) ndarray
        The peak's own where there is one, else as the layer's other peaks foretell.
    """

    chosen: NDArray[np.intp]
    frequencies_hz: Floats
    bandwidths_hz: Floats


@dataclass(frozen=True, eq=False)
class _Votes:
    """All peaks of all conditions, n of them; logarithms relative to the grid's middle."""

    condition: NDArray[np.intp]
    index: NDArray[np.intp]
    x: Floats
    y: Floats
    frequency: Floats
    bandwidth: Floats
    weight: Floats

    @property
    def tolerance(self) -> Floats:
        return np.clip(0.6 * np.exp(self.bandwidth - self.frequency), *TOLERANCE)


def find_tracks(found: Mapping[Condition, Peaks]) -> Tracks:
    """The layers of one texture, by their frequency at the strongest force and fastest speed.

    Parameters
    ----------
    found : mapping of (speed, force) to Peaks
        Conditions in any order; the rows of the result keep it.
    """
    places = np.log(np.array(list(found)))
    places = places - places.mean(axis=0)
    votes = _votes(found, places)
    laws = _laws(votes, len(found))
    for _ in range(ROUNDS):
        owner = _owners(votes, laws)
        laws = [_fitted(votes, owner == i, law) for i, law in enumerate(laws)]
    owner = _merged(votes, _owners(votes, laws), laws)
    least = LEAST_SUPPORT * len(found)
    supported = [i for i in range(len(laws)) if float(votes.weight[owner == i].sum()) >= least]
    return _tracks(votes, owner, laws, supported, places)


def _votes(found: Mapping[Condition, Peaks], places: Floats) -> _Votes:
    sizes = [peaks.gains.size for peaks in found.values()]
    condition = np.repeat(np.arange(len(sizes)), sizes)

    def all_of(name: str) -> Floats:
        return np.concatenate([getattr(peaks, name) for peaks in found.values()])

    return _Votes(
        condition,
        np.concatenate([np.arange(size) for size in sizes]),
        places[condition, 0],
        places[condition, 1],
        np.log(all_of("frequencies_hz")),
        np.log(all_of("bandwidths_hz")),
        np.clip(all_of("evidence") / CLEAR_EVIDENCE, 0.0, 1.0),
    )


def _design(x: Floats, y: Floats) -> Floats:
    """Terms of a law: level, power of the speed, power of the force, curvature over speed."""
    return np.stack((np.ones_like(x), x, y, x * x), axis=-1)


def _laws(votes: _Votes, conditions: int) -> list[Floats]:
    """Greedy Hough transform: laws by falling support, each taking its peaks away."""
    left = votes.weight.copy()
    laws: list[Floats] = []
    flat = votes.frequency - EXPONENTS[:, None] * votes.x  # (exponents, n)
    everyone = np.arange(left.size)
    # One exponent at a time: all pairs of all peaks of a large grid would fill the memory.
    support = np.array([_votes_for(votes, row, everyone) @ left for row in flat])
    while len(laws) < votes.frequency.size:
        exponent, seed = np.unravel_index(int(np.argmax(support)), support.shape)
        if support[exponent, seed] < LEAST_SUPPORT * conditions:
            break
        start = np.array([flat[exponent, seed], EXPONENTS[exponent], 0.0, 0.0])
        mine = _nearest_of_each(votes, start, left > 0)
        law = _fitted(votes, mine, start)
        laws.append(law)
        # One peak of each condition; the others there vote for laws of their own.
        taken = np.flatnonzero(mine | _nearest_of_each(votes, law, left > 0))
        support -= np.array([_votes_for(votes, row, taken) @ left[taken] for row in flat])
        left[taken] = 0.0
    return laws


def _votes_for(votes: _Votes, flat: Floats, voters: NDArray[np.intp]) -> Floats:
    """How much each voter is for a law through each peak, (n, voters), 0 beyond its tolerance."""
    distance = (flat[:, None] - flat[voters]) / votes.tolerance[voters]
    return np.maximum(1 - distance * distance, 0.0)


def _nearest_of_each(votes: _Votes, law: Floats, among: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """In each condition the peak nearest to a law, if it is within the tolerance."""
    distance = np.where(among, _distance(votes, law), np.inf)
    order = np.argsort(distance, kind="stable")
    _, first = np.unique(votes.condition[order], return_index=True)
    mine = np.zeros(distance.size, dtype=bool)
    mine[order[first]] = distance[order[first]] < 1
    return mine


def _distance(votes: _Votes, law: Floats) -> Floats:
    """Distance of every peak from a law, 1 at the tolerance."""
    return np.abs(votes.frequency - _design(votes.x, votes.y) @ law) / votes.tolerance


def _fitted(votes: _Votes, mine: NDArray[np.bool_], law: Floats) -> Floats:
    """The law of these peaks by weighted least squares, held to the old one where they are few."""
    if not mine.any():
        return law
    # A ridge in the units of one clear peak: two or three peaks must not bend a law.
    return _ridge_fit(
        _design(votes.x[mine], votes.y[mine]),
        votes.frequency[mine],
        weight=votes.weight[mine],
        towards=law * HELD,
    )


def _ridge_fit(design: Floats, values: Floats, *, weight: Floats, towards: Floats) -> Floats:
    """Coefficients of a law by weighted least squares, drawn `towards` some by `RIDGE`."""
    ridge = np.array(RIDGE) + 1e-9
    normal = (design.T * weight) @ design + np.diag(ridge)
    pull: Floats = (design.T * weight) @ values + ridge * towards
    return np.asarray(np.linalg.solve(normal, pull), dtype=np.float64)


def _owners(votes: _Votes, laws: list[Floats]) -> NDArray[np.intp]:
    """The law of each peak, −1 where none: within a condition each law has one peak at most."""
    from scipy.optimize import linear_sum_assignment

    owner = np.full(votes.frequency.size, -1, dtype=np.intp)
    if not laws:
        return owner
    distance = np.stack([_distance(votes, law) for law in laws], axis=1)
    # A clear peak goes before a doubtful one that lies a little nearer.
    cost = np.where(distance < 1, distance**2 - 1 - votes.weight[:, None], 0.0)
    for condition in np.unique(votes.condition):
        here = np.flatnonzero(votes.condition == condition)
        rows, columns = linear_sum_assignment(cost[here])
        valid = cost[here[rows], columns] < 0
        owner[here[rows[valid]]] = columns[valid]
    return owner


def _merged(votes: _Votes, owner: NDArray[np.intp], laws: list[Floats]) -> NDArray[np.intp]:
    """Owners where a law that only fills another's gaps, close to it, has been given to it.

    At the ends of a grid a peak may be pushed off its law, as by the lower end of the band.
    """
    sizes = [int((owner == i).sum()) for i in range(len(laws))]
    for small in np.argsort(sizes, kind="stable"):
        mine = owner == small
        for large in np.argsort(sizes, kind="stable")[::-1]:
            theirs = owner == large
            if large == small or not mine.any() or sizes[large] < sizes[small]:
                continue
            both = np.intersect1d(votes.condition[mine], votes.condition[theirs])
            near = float(np.median(_distance(votes, laws[large])[mine])) < MERGING_DISTANCE
            if near and both.size <= 0.25 * mine.sum():
                owner = np.where(mine & ~np.isin(votes.condition, both), large, owner)
                owner = np.where(owner == small, -1, owner)
                break
    return owner


def _tracks(
    votes: _Votes,
    owner: NDArray[np.intp],
    laws: list[Floats],
    supported: list[int],
    places: Floats,
) -> Tracks:
    design = _design(places[:, 0], places[:, 1])
    top = int(np.lexsort((places[:, 0], places[:, 1]))[-1])
    order = sorted(supported, key=lambda i: float(design[top] @ laws[i]))
    shape = (len(places), len(order))
    chosen = np.full(shape, -1, dtype=np.intp)
    frequency, bandwidth = np.ones(shape), np.ones(shape)
    for layer, number in enumerate(order):
        mine = np.flatnonzero(owner == number)
        at = votes.condition[mine]
        chosen[at, layer] = votes.index[mine]
        frequency[at, layer] = np.exp(votes.frequency[mine])
        bandwidth[at, layer] = np.exp(votes.bandwidth[mine])
    foretold = foretell(places, frequency, bandwidth, present=chosen >= 0)
    return _with_edges(Tracks(chosen, *foretold), votes)


def _with_edges(tracks: Tracks, votes: _Votes) -> Tracks:
    """Layers that have left the band below take the peak that they leave at its lower end."""
    chosen, frequency = tracks.chosen.copy(), tracks.frequencies_hz.copy()
    bandwidth = tracks.bandwidths_hz.copy()
    for row, layer in np.argwhere((chosen < 0) & (frequency < LOWEST_HZ)):
        free = (votes.condition == row) & ~np.isin(votes.index, chosen[row])
        near = np.flatnonzero(free & (votes.frequency < np.log(2 * LOWEST_HZ)))
        if near.size:
            lowest = near[np.argmin(votes.frequency[near])]
            chosen[row, layer] = votes.index[lowest]
            frequency[row, layer] = np.exp(votes.frequency[lowest])
            bandwidth[row, layer] = np.exp(votes.bandwidth[lowest])
    return Tracks(chosen, frequency, bandwidth)


def foretell(
    places: Floats, frequencies_hz: Floats, bandwidths_hz: Floats, *, present: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Frequencies and bandwidths (C, m), those not present told from the layer's others.

    The frequency follows the layer's law, off by as much as its nearest peak is; the bandwidth is
    the layer's median.

    Parameters
    ----------
    places : (C, 2) ndarray
        Log speed and log force.
    frequencies_hz, bandwidths_hz : (C, m) ndarray
        Read only where `present`.
    present : (C, m) ndarray of bool
        At least one in each column.
    """
    frequency, bandwidth = frequencies_hz.copy(), bandwidths_hz.copy()
    gaps = ((places[:, None, :] - places[None, :, :]) ** 2).sum(axis=2)
    for layer, known in enumerate(present.T):
        law = _law_of(places, frequencies_hz[:, layer], known)
        offset = np.log(frequencies_hz[known, layer]) - law[known]
        nearest = np.argmin(gaps[:, known], axis=1)
        frequency[~known, layer] = np.exp(law + offset[nearest])[~known]
        bandwidth[~known, layer] = np.median(bandwidths_hz[known, layer])
    return frequency, bandwidth


def strayed(
    places: Floats, frequencies_hz: Floats, *, present: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which of the present frequencies (C, m) lie off their layer's law as its others do not."""
    off = np.zeros(present.shape, dtype=bool)
    for layer, known in enumerate(present.T):
        for _ in range(ROUNDS):
            law = _law_of(places, frequencies_hz[:, layer], known & ~off[:, layer])
            distance = np.abs(np.log(frequencies_hz[:, layer]) - law)
            usual = float(np.median(distance[known]))
            off[:, layer] = known & (distance > max(STRAYED_SPREADS * usual, TOLERANCE[0]))
    return off


def _law_of(places: Floats, frequencies_hz: Floats, known: NDArray[np.bool_]) -> Floats:
    """Log frequency in every condition by the law of the known ones, (C,)."""
    design = _design(*(places - places.mean(axis=0)).T)
    log_f = np.log(frequencies_hz[known])
    law = _ridge_fit(design[known], log_f, weight=np.ones(log_f.size), towards=np.zeros(4))
    told: Floats = design @ law
    return told
