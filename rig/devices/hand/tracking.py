"""From positions to signed tangential speed, with a stated delay (docs/method/hand.md#speed)."""

from __future__ import annotations

from collections import deque
from math import exp, hypot, sqrt

REST_S = 0.02
NEW_STROKE_S = 0.1
AXIS_S = 0.5
_SAME_MOMENT_S = 1e-6  # what the kernel's clock of events tells apart
_FINEST = 40  # two steps are at least this part of a window; a mouse of 8 kHz needs not all
_FURTHEST_MM = 1e9


class TrackingFilter:
    """Speed of what moves, from its positions at any moments.

    The velocity is the least-squares slope over the last 2 · `delay_s` of the straight lines
    between positions; its length is the tangential speed, its sign that of its direction along an
    axis that follows the strokes slowly.

    Parameters
    ----------
    delay_s : float
        Above 0. At constant acceleration the speed is that of `delay_s` before the last position.
    rest_s : float
        A device that reports only changes rests where it has been silent for this long.
    """

    def __init__(self, delay_s: float, *, rest_s: float = REST_S) -> None:
        self.delay_s = delay_s
        self._rest_s = rest_s
        self.reset()

    def reset(self) -> None:
        """Forget all positions and the axis: a hand at rest."""
        self._axis = (1.0, 0.0)
        self._spread = (0.0, 0.0, 0.0)
        self._start_anew()

    def _start_anew(self) -> None:
        self._track: deque[tuple[float, float, float]] = deque()
        self._velocity = (0.0, 0.0)

    def update(self, time_s: float, x_mm: float, y_mm: float = 0.0) -> float:
        """Signed speed (mm/s) as of a new position (mm) at a later moment (s).

        A moment that is not later than the last one replaces the last position. After 0.1 s
        without a position, or one that is not a number, the hand starts from rest.
        """
        if not (abs(x_mm) < _FURTHEST_MM and abs(y_mm) < _FURTHEST_MM):
            self._start_anew()
            return 0.0
        track = self._track
        if track and time_s - track[-1][0] < _SAME_MOMENT_S:
            time_s = track.pop()[0]
        if track and time_s - track[-1][0] > NEW_STROKE_S:
            self._start_anew()
            track = self._track
        step_s = time_s - track[-1][0] if track else 0.0
        if len(track) > 1 and time_s - track[-2][0] < 2 * self.delay_s / _FINEST:
            track.pop()
        track.append((time_s, x_mm, y_mm))
        # One position before the window stays: the line from it reaches into the window.
        while len(track) > 2 and track[1][0] <= time_s - 2 * self.delay_s:
            track.popleft()
        self._velocity = self._slope(time_s)
        self._follow(step_s)
        return self._signed(self._velocity)

    def at(self, time_s: float) -> float:
        """Signed speed (mm/s) at a moment after the last position.

        That of the last position, until the device has been silent for so long that it rests; from
        then on as if it had rested since, which ends at 0 after 2 · `delay_s`.
        """
        if not self._track:
            return 0.0
        silent = time_s - self._track[-1][0] - self._rest_s
        if silent <= 0:
            return self._signed(self._velocity)
        return self._signed(self._slope(self._track[-1][0] + silent))

    def _slope(self, end_s: float) -> tuple[float, float]:
        """Velocity over the window that ends here; outside the track nothing moves."""
        window = 2 * self.delay_s
        start, vx, vy = end_s - window, 0.0, 0.0
        track = self._track
        for index in range(1, len(track)):
            (t0, x0, y0), (t1, x1, y1) = track[index - 1], track[index]
            share = _smoothstep((t1 - start) / window) - _smoothstep((t0 - start) / window)
            vx += (x1 - x0) / (t1 - t0) * share
            vy += (y1 - y0) / (t1 - t0) * share
        return vx, vy

    def _follow(self, step_s: float) -> None:
        """Turn the axis towards the direction in which most movement went lately."""
        vx, vy = self._velocity
        keep = exp(-step_s / AXIS_S)
        xx, xy, yy = (keep * value for value in self._spread)
        self._spread = (xx + vx * vx * step_s, xy + vx * vy * step_s, yy + vy * vy * step_s)
        self._axis = _main_axis(*self._spread, near=self._axis)

    def _signed(self, velocity: tuple[float, float]) -> float:
        along = velocity[0] * self._axis[0] + velocity[1] * self._axis[1]
        return hypot(*velocity) if along >= 0 else -hypot(*velocity)


def noise_gain_per_s(delay_s: float, period_s: float) -> float:
    """Standard deviation of the speed (per s) for a unit one of independent errors of positions.

    Parameters
    ----------
    delay_s, period_s : float
        Of the filter; of the positions, which come at equal times, n = 2 · delay / period of them
        in a window (exact for whole n).

    Notes
    -----
    Var = (12 n − 18 + 8/n²) / (n⁴ T²), for large n 12 T / (2 delay)³: docs/method/hand.md#noise.
    """
    n = 2 * delay_s / period_s
    if n <= 1:
        return sqrt(2) / period_s
    return sqrt((12 * n - 18 + 8 / n**2) / n**4) / period_s


def _smoothstep(share: float) -> float:
    """Integral of the weight 6 s (1 − s) up to here, 0 before and 1 behind the window."""
    s = min(max(share, 0.0), 1.0)
    return s * s * (3 - 2 * s)


def _main_axis(
    xx: float, xy: float, yy: float, *, near: tuple[float, float]
) -> tuple[float, float]:
    """Unit vector along which [[xx, xy], [xy, yy]] is largest, of the two the one near another."""
    middle, half = hypot((xx - yy) / 2, xy), (xx - yy) / 2
    # Of the two columns that span the eigenvector, the one further from zero.
    x, y = (half + middle, xy) if half >= 0 else (xy, middle - half)
    length = hypot(x, y)
    if length == 0:
        return near
    sign = 1.0 if x * near[0] + y * near[1] >= 0 else -1.0
    return sign * x / length, sign * y / length
