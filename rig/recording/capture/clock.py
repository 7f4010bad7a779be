"""When the samples of a sound card were measured, on the clock of the rig.

docs/method/strokes.md#clocks
"""

from __future__ import annotations

from collections import deque

import numpy as np

from tactileq.modeling.arrays import Floats

WINDOW_S = 30.0
# A slope over less is worse than the nominal rate, which is off by 0.01 % at most in most cards.
SHORTEST_FOR_DRIFT_S = 5.0


class SampleClock:
    """Time of every sample by linear regression of the blocks' times on their positions.

    Each block says when it was measured, by a clock that is read with some jitter; over the last
    30 s the line through all of them is more accurate, and gives the card's true rate.

    Parameters
    ----------
    rate_hz : float
        As the card states it.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self.restart()

    def restart(self) -> None:
        """Forget all blocks: positions have lost their meaning."""
        self._first = (0, 0.0)
        self._blocks: deque[Floats] = deque()
        self._sums: Floats = np.zeros(6)

    def add(self, position: int, time_s: float) -> None:
        """Record that the sample at a position (from the stream's start) was measured at a time."""
        if not self._blocks:
            self._first = (position, time_s)
        seconds = (position - self._first[0]) / self._rate_hz
        late = time_s - self._first[1] - seconds
        # Sums for a line through the lateness over time, in which nothing large cancels.
        products = (1.0, seconds, late, seconds * seconds, seconds * late, late * late)
        self._blocks.append(np.array(products))
        self._sums += self._blocks[-1]
        while seconds - self._blocks[0][1] > WINDOW_S:
            self._sums -= self._blocks.popleft()

    def times_s(self, position: int, count: int) -> Floats:
        """Times (count,) of the samples from a position on; at least one block was added."""
        middle, late, slope = self._line()
        steps = np.arange(count, dtype=np.float64) + (position - self._first[0])
        seconds = steps / self._rate_hz
        times: Floats = self._first[1] + seconds + late + slope * (seconds - middle)
        return times

    @property
    def drift_ppm(self) -> float:
        """By how many millionths the card is faster than it states; 0 before 5 s have passed."""
        return 1e6 * (1 / (1 + self._line()[2]) - 1)

    @property
    def jitter_s(self) -> float:
        """RMS by which the blocks' own times are off the line."""
        count, *_, squares = self._sums.tolist()
        if count < 2:
            return 0.0
        _, mean, slope = self._line()
        explained = slope**2 * self._spread()
        return float(np.sqrt(max(squares / count - mean**2 - explained / count, 0.0)))

    def _spread(self) -> float:
        """Sum of squares of the blocks' times about their mean, s²."""
        count, seconds, _, squares, _, _ = self._sums
        return float(squares - seconds**2 / count)

    def _line(self) -> tuple[float, float, float]:
        """Seconds since the first block in the middle of the blocks, lateness there, its slope."""
        count, seconds, late, _, products, _ = self._sums.tolist()
        if not self._blocks:
            return 0.0, 0.0, 0.0
        middle, mean = seconds / count, late / count
        if self._blocks[-1][1] - self._blocks[0][1] < SHORTEST_FOR_DRIFT_S:
            return middle, mean, 0.0
        return middle, mean, (products - seconds * late / count) / self._spread()
