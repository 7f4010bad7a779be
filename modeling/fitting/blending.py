"""What is rendered between the nodes: no blend may fall into a hole that its nodes do not have.

The likelihood of records at the nodes sees magnitudes only. Layers whose sum has turned its sign
from one node to the next fit both, and cancel half-way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.estimation.coherent import Observed, Response, response
from tactileq.modeling.estimation.compiled import held_by_cells, is_compiled
from tactileq.modeling.estimation.likelihood import NEPER_DB, split
from tactileq.modeling.fitting.equations import STEP_OF_CORNERS, Blocks, of_cells

REACH = 6.0  # of a moving peak to either side, in widths
# In nepers: a peak that meets another one at two of four corners is twice as high there.
MEETING = np.log(2) / 2
# In log likelihood, per frequency: half of this times the square of what is beyond.
HELD = 20.0
# Places that move with a layer: from its frequency, in widths.
AROUND = np.array([-1.5, -0.75, 0.0, 0.75, 1.5])


class BlendPenalty(NamedTuple):
    """What blends that are off cost, and its derivatives by the parameters of the nodes (N, p)."""

    cost: float
    information: Blocks
    score: Floats


class _Seen(NamedTuple):
    """The middles: `off` (M, …) in nepers, 0 where nothing is held, at fixed and at moving places.

    `lowest` (M, …) is the corner that a place is held to, −1 for the mean of all; `passed` (M, n)
    are fixed places that a moving layer passes, `moving` (M, …) the others that count;
    `by_parameter` (M + N, p, …) are relative derivatives of power, in the middles and at the nodes.
    """

    off: Floats
    lowest: Integers
    passed: Bools
    moving: Bools
    by_parameter: Floats


def distances_db(one: Floats, other: Floats, places: Observed) -> Floats:
    """Log-spectral distances (K,) of responses in nepers (K, n), as an RMS over frequency.

    At places that are evenly spaced in the logarithm of frequency.
    """
    frequency = np.arctan(places.tangent[0])
    square = (one - other) ** 2 @ frequency / frequency.sum()
    return np.asarray(NEPER_DB * np.sqrt(square))


@dataclass(frozen=True, eq=False)
class Middles:
    """The middles of a lattice's cells in log speed and log force.

    Parameters
    ----------
    corners : (M, 4) ndarray of int
    shares : (4,) ndarray
        Of each corner in the middle.
    places : Observed
        One row: the frequencies that are looked at.
    count : int
        Nodes of the lattice.
    """

    corners: Integers
    shares: Floats
    places: Observed
    count: int

    def defects_db(self, theta: Floats, signs: Floats) -> Floats:
        """Distance of each middle's response from what it is held to, (M,).

        Where peaks pass, by the places along them.
        """
        middles = self._seen(theta, signs)
        n = middles.passed.shape[1]
        frequency = np.arctan(self.places.tangent[0])
        share = frequency / frequency.sum()
        along = (middles.off[:, n:] ** 2).sum(axis=1)
        along /= np.maximum(middles.moving.sum(axis=1), 1)
        fixed = np.where(middles.passed, 0.0, middles.off[:, :n]) ** 2
        square = fixed @ share + along * (middles.passed @ share)
        return np.asarray(NEPER_DB * np.sqrt(square))

    def held(self, theta: Floats, signs: Floats) -> BlendPenalty:
        """The cost of what is off in the middles, from the parameters (N, p) of the nodes."""
        seen = self._seen(theta, signs)
        m, off = len(self.corners), seen.off
        cost = 0.5 * HELD * float((off**2).sum())
        if is_compiled():
            blocks, score = held_by_cells(
                seen.by_parameter,
                off,
                seen.lowest,
                corners=self.corners,
                shares=self.shares,
                steps=STEP_OF_CORNERS,
                held=HELD,
            )
            return BlendPenalty(cost, Blocks(*blocks), score)
        slope = 0.5 * seen.by_parameter
        far = np.flatnonzero(off.any(axis=1))
        p = theta.shape[1]
        # By the parameters of each corner: of the blend, less of the corners that it is held to.
        lowest = seen.lowest[far][:, None]
        one = lowest == np.arange(4)[:, None]
        less = np.where(lowest < 0, self.shares[:, None], one)[:, :, None]
        pull = self.shares[:, None, None] * slope[far][:, None]
        pull -= less * slope[m:][self.corners[far]]
        pull *= (off[far] != 0)[:, None, None, :]
        flat = pull.reshape(len(far), 4 * p, slope.shape[2])
        blocks = (HELD * flat @ flat.transpose(0, 2, 1)).reshape(len(far), 4, p, 4, p)
        score = np.zeros(theta.shape)
        along = -HELD * np.einsum("mapn,mn->map", pull, off[far])
        np.add.at(score, self.corners[far], along)
        information = of_cells(self.corners[far], blocks, self.count)
        return BlendPenalty(cost, information, score)

    def _seen(self, theta: Floats, signs: Floats) -> _Seen:
        """What the middles are held to, and how far off they are.

        At a fixed place to the mean of the corners' logarithms. Where a layer moves by more than
        its width that means nothing: there a middle may be no lower than the lowest corner, and at
        places that move with the layer it is held near the mean.
        """
        middle = np.einsum("a,map->mp", self.shares, theta[self.corners])
        both, m = np.concatenate((middle, theta)), len(self.corners)
        moves, passed = self._moving(theta)
        layers = np.flatnonzero(moves.any(axis=0))
        found = self._responses(both, signs, layers)
        level = 0.5 * np.log(found.power)
        corners = level[m:][self.corners]
        off = level[:m] - np.einsum("a,man->mn", self.shares, corners)
        lowest = np.full(off.shape, -1)
        moving = np.repeat(moves[:, layers], AROUND.size, axis=1)
        if layers.size:
            n = passed.shape[1]
            fixed = np.where((self.shares > 0)[:, None], corners[:, :, :n], np.inf)
            lowest[:, :n] = np.where(passed, fixed.argmin(axis=1), -1)
            hole = np.minimum(level[:m, :n] - fixed.min(axis=1), 0.0)
            off[:, :n] = np.where(passed, hole, off[:, :n])
            beyond = np.maximum(np.abs(off[:, n:]) - MEETING, 0.0)
            off[:, n:] = moving * np.sign(off[:, n:]) * beyond
        return _Seen(off, lowest, passed, moving, found.by_parameter)

    def _moving(self, theta: Floats) -> tuple[Bools, Bools]:
        """Which layers move by more than their width, (M, m), and the places they pass, (M, n)."""
        layers = (theta.shape[1] - 1) // 3
        _, frequency, bandwidth, _ = split(theta[self.corners], layers)
        width = np.exp(bandwidth.max(axis=1))
        lowest, highest = np.exp(frequency.min(axis=1)), np.exp(frequency.max(axis=1))
        moves = highest - lowest > width
        place = np.arctan(self.places.tangent[0]) * self.places.rate_hz / np.pi
        passed = np.zeros((len(self.corners), place.size), dtype=bool)
        for layer in np.flatnonzero(moves.any(axis=0)):
            reach = np.where(moves[:, layer], REACH * width[:, layer], -np.inf)[:, None]
            below = lowest[:, [layer]] - reach < place
            passed |= below & (place < highest[:, [layer]] + reach)
        return moves, passed

    def _responses(self, theta: Floats, signs: Floats, moving: Integers) -> Response:
        """At the fixed places, then at those that move with some of the layers, (K, n + …)."""
        rows, fixed = len(theta), self.places.tangent
        if not moving.size:
            return response(theta, signs, self.places.rows(np.zeros(rows, dtype=np.intp)))
        per_hz = np.pi / self.places.rate_hz
        _, frequency, bandwidth, _ = split(theta, signs.size)
        centre = np.exp(frequency[:, moving])[..., None]
        away = np.exp(bandwidth[:, moving])[..., None] * AROUND
        ends = np.arctan(fixed[0, [0, -1]]) / per_hz
        own = np.tan(per_hz * np.clip(centre + away, *ends)).reshape(rows, -1)
        tangent = np.concatenate((np.broadcast_to(fixed, (rows, fixed.size)), own), axis=1)
        one = np.ones(tangent.shape)
        places = Observed(one, one, one, tangent, 1 / tangent, np.zeros(rows), self.places.rate_hz)
        found = response(theta, signs, places)
        inside = (centre + away > ends[0]) & (centre + away < ends[1])
        by_hz = found.by_tangent[:, fixed.size :] * per_hz * (1 + own**2)
        by_hz = by_hz.reshape(away.shape) * inside
        for number, layer in enumerate(moving):
            first = fixed.size + number * AROUND.size
            of_layer = found.by_parameter[:, :, first : first + AROUND.size]
            of_layer[:, 1 + layer] += by_hz[:, number] * centre[:, number]
            of_layer[:, 1 + signs.size + layer] += by_hz[:, number] * away[:, number]
        return found
