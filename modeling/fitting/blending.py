"""What is rendered between the nodes: no blend may fall into a hole that its nodes do not have.

The likelihood of records at the nodes sees magnitudes only. Layers whose sum has turned its sign
from one node to the next fit both, and cancel half-way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modeling.arrays import Floats, Integers
from modeling.estimation.coherent import Observed, Response, response
from modeling.estimation.compiled import held_by_cells, is_compiled
from modeling.estimation.likelihood import split
from modeling.fitting.equations import STEP_OF_CORNERS, Blocks, of_cells

REACH = 6.0  # of a moving peak to either side, in widths
# In log likelihood, per frequency: half of this times the square of what is beyond.
HELD = 20.0
NEPER_DB = 20 / np.log(10)


class Held(NamedTuple):
    """What holes cost, and its derivatives by the parameters of the nodes (N, p)."""

    cost: float
    information: Blocks
    score: Floats


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
        """Distance of each middle's response from the mean of its corners' logarithms, (M,)."""
        level = self._levels(theta, signs)
        return distances_db(self._off(theta, level), np.zeros(level.shape[1]), self.places)

    def held(self, theta: Floats, signs: Floats) -> Held:
        """The cost of holes in the middles, from the parameters (N, p) of the nodes."""
        m = len(self.corners)
        found = self._response(theta, signs)
        level, slope = 0.5 * np.log(found.power), 0.5 * found.by_parameter
        off = self._off(theta, level)
        cost = 0.5 * HELD * float((off**2).sum())
        if is_compiled():
            blocks, score = held_by_cells(
                found.by_parameter,
                off,
                corners=self.corners,
                shares=self.shares,
                steps=STEP_OF_CORNERS,
                held=HELD,
            )
            return Held(cost, Blocks(*blocks), score)
        far = np.flatnonzero(off.any(axis=1))
        p = theta.shape[1]
        # By the parameters of each corner: of the blend, less of the corner itself.
        pull = slope[far][:, None] - slope[m:][self.corners[far]]
        pull *= self.shares[None, :, None, None] * (off[far] != 0)[:, None, None, :]
        flat = pull.reshape(len(far), 4 * p, slope.shape[2])
        blocks = (HELD * flat @ flat.transpose(0, 2, 1)).reshape(len(far), 4, p, 4, p)
        score = np.zeros(theta.shape)
        along = -HELD * np.einsum("mapn,mn->map", pull, off[far])
        np.add.at(score, self.corners[far], along)
        information = of_cells(self.corners[far], blocks, self.count)
        return Held(cost, information, score)

    def _off(self, theta: Floats, level: Floats) -> Floats:
        """Middles less the mean of their corners (M, n) in nepers; 0 where that means nothing.

        Where a layer moves by more than its width, corners have its peak and the middle has it
        elsewhere.
        """
        layers = (theta.shape[1] - 1) // 3
        _, frequency, bandwidth, _ = split(theta[self.corners], layers)
        width = np.exp(bandwidth.max(axis=1))
        lowest, highest = np.exp(frequency.min(axis=1)), np.exp(frequency.max(axis=1))
        reach = np.where(highest - lowest > width, REACH * width, -np.inf)
        place = np.arctan(self.places.tangent[0]) * self.places.rate_hz / np.pi
        below = (lowest - reach)[..., None] < place
        passed = (below & (place < (highest + reach)[..., None])).any(axis=1)
        m = len(self.corners)
        return np.asarray(np.where(passed, 0.0, level[:m] - self._mean(level[m:])))

    def _mean(self, levels: Floats) -> Floats:
        """Means of the logarithms at the corners (M, n), from those at the nodes (N, n)."""
        return np.asarray(np.einsum("a,man->mn", self.shares, levels[self.corners]))

    def _levels(self, theta: Floats, signs: Floats) -> Floats:
        return np.asarray(0.5 * np.log(self._response(theta, signs).power))

    def _response(self, theta: Floats, signs: Floats) -> Response:
        """In the middles, then at the nodes, (M + N, n)."""
        middle = np.einsum("a,map->mp", self.shares, theta[self.corners])
        both = np.concatenate((middle, theta))
        return response(both, signs, self.places.rows(np.zeros(len(both), dtype=np.intp)))
