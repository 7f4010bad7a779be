"""Damping and mass of a force device, from its motion under a known force.

The tool rests on a soft virtual wall and is pushed with a sum of sines; nobody holds it
(docs/force-device.md#damping).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, floor, log10, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.rig.desk.calibration.stiffness import armed_at, is_commanded
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.states import State
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.memory import Live

SOFT_N_PER_MM, LEAST_N_PER_MM = 0.1, 0.02
RUN_S = 2.0
RUNS = 12  # half of them with half the force
TONES_HZ = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 9.0, 11.0, 14.0, 17.0, 21.0, 26.0, 32.0)
LEAST_COHERENCE = 0.9
WIDEST = 0.5  # half of a 95 % interval, of its value
_DEPTH_MM = 5.0  # into the wall by a constant force, about which the tool swings
_SWING_MM = 2.0
_PEAK_N = (0.1, 0.4)  # of the sines: first, and at most
_RAMP_S = 1.0
_EVERY_S = 0.001723  # hardly ever whole ticks: which of two things came first is then known
_STILL_HZ = (50.0, 64.0)  # where no sine is, nor much of the motion that ends leave
_SMOOTHED_S = 0.02  # a speed is measured over this time, as steps of the encoder are large
_RELATIVE = 0.02  # of what is never exact: steps of the force, a wall's edge

Complexes = NDArray[np.complex128]
Counts = NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """A tool on a soft wall under a force that varies.

    Parameters
    ----------
    time_s, depth_mm : (n,) ndarray
        When the depth below the wall's height was read; 20 or more, rising.
    pressed_s, press_n : (m,) ndarray
        When the commanded force into the wall changed, and to what; the first one before `time_s`.
    peak_n : float
        Of the sines.
    """

    time_s: Floats
    depth_mm: Floats
    pressed_s: Floats
    press_n: Floats
    peak_n: float


@dataclass(frozen=True, kw_only=True)
class Bounded:
    """Mean over runs, and half of its 95 % interval."""

    value: float
    half: float

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.value - self.half

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.value + self.half

    @property
    def identified(self) -> bool:
        """Whether it lies above 0 and is known to within half of itself."""
        return self.value > 0 and self.half <= WIDEST * self.value

    def __str__(self) -> str:
        digits = max(0, 1 - floor(log10(max(self.half, 1e-6))))
        low, value, high = (f"{one:.{digits}f}" for one in (self.low, self.value, self.high))
        return f"{value} (95 % {low} to {high})"


@dataclass(frozen=True, kw_only=True)
class Damping:
    """What a device does to a commanded force.

    Parameters
    ----------
    damping_n_s_per_m, dry_n : Bounded
        Viscous damping along the wall's normal, and dry (Coulomb) friction beside it.
    mass_kg, delay_ms : Bounded
        The time is that from a reading to the force that answers it, without the half period for
        which a servo holds it.
    coherence : float
        Least share of a run's motion that follows from the force.
    """

    damping_n_s_per_m: Bounded
    dry_n: Bounded
    mass_kg: Bounded
    delay_ms: Bounded
    coherence: float

    @property
    def least_damping_n_s_per_m(self) -> float:
        """Lower end of the interval, rounded down: what passivity may count on."""
        return floor(1e4 * self.damping_n_s_per_m.low) / 1e4

    @property
    def most_delay_ms(self) -> float:
        """Upper end of the interval, rounded up: what passivity has to reckon with."""
        return ceil(1e4 * self.delay_ms.high) / 1e4


def soft_wall_n_per_mm(largest_n_per_mm: float) -> float:
    """Stiffness of the soft wall on a device whose walls are taken to be passive up to this one.

    Raises
    ------
    InputError
        For a device on which no such wall is.
    """
    if largest_n_per_mm < LEAST_N_PER_MM:
        raise InputError(
            f"expected a device whose walls are taken to be passive up to {LEAST_N_PER_MM:g} N/mm, "
            f"got {max(0.0, largest_n_per_mm):.3g} N/mm; write a rough guess as force.damping, "
            'such as value = 0.5, unit = "N·s/m", assumed = true.'
        )
    return min(SOFT_N_PER_MM, largest_n_per_mm)


def shaken(
    live: Live,
    hand: ForceHand,
    *,
    stiffness_n_per_mm: float,
    period_s: float,
    tick: Callable[[float], None],
) -> tuple[Run, ...]:
    """Shake the tool on a soft wall that begins where it is now; nobody may hold it.

    Parameters
    ----------
    stiffness_n_per_mm : float
        Of that wall: at most `SOFT_N_PER_MM`, and passive.
    period_s : float
        Of the servo.
    tick : callable
        Takes the share that is done.

    Raises
    ------
    InputError
        If the device lets go, or the tool leaves the wall.
    """
    height_mm = armed_at(live, hand)
    hand.hide()
    hand.show(Wall(height_mm=height_mm, stiffness_n_per_mm=stiffness_n_per_mm))
    rest_n, rng = stiffness_n_per_mm * _DEPTH_MM, np.random.default_rng(0)
    shaker = _Shaker(live, hand, period_s=period_s)
    peak_n = min(_PEAK_N[0], 0.8 * rest_n)
    runs: list[Run] = []
    try:
        shaker.push(lambda s: rest_n * (1 - np.cos(pi * s / _RAMP_S)) / 2, seconds=_RAMP_S)
        shaker.push(lambda _: rest_n, seconds=_RAMP_S)
        for number in range(RUNS + 1):
            half = 0.5 if number % 2 else 1.0
            run = shaker.run(rest_n, sines(rng, peak_n=half * peak_n), peak_n=half * peak_n)
            if number == 0:  # how far it swings
                share = _SWING_MM / max(1e-3, float(np.ptp(run.depth_mm)) / 2)
                peak_n = min(_PEAK_N[1], 0.8 * rest_n, share * peak_n)
            else:
                runs.append(run)
            tick((number + 1) / (RUNS + 1))
    finally:
        hand.control.press(0.0)
        hand.hide()
    return tuple(runs)


class _Shaker:
    """Pushes with a force over time, and keeps what it commanded and what was read."""

    def __init__(self, live: Live, hand: ForceHand, *, period_s: float) -> None:
        self._live, self._hand, self._period_s = live, hand, period_s

    def push(self, force_n: Callable[[float], float], *, seconds: float) -> tuple[Floats, Floats]:
        """Push for so long; when which force was asked for."""
        times, forces = [], []
        with taking_part():  # or a force would come later than its time on a clock that tests give
            begin_s = now_s()
            while (since_s := now_s() - begin_s) < seconds:
                self._live.heartbeat()
                times.append(begin_s + since_s)
                forces.append(float(force_n(since_s)))
                self._hand.control.press(forces[-1])
                sleep(_EVERY_S)
                if (status := self._hand.status).state != State.RUNNING:
                    raise InputError(status.sentence)
        return np.array(times), np.array(forces)

    def run(self, rest_n: float, sines_n: Callable[[float], float], *, peak_n: float) -> Run:
        """One run, with the force as of the ticks at which the servo saw it."""
        since = self._live.readings_written
        times, forces = self.push(lambda s: rest_n + sines_n(s), seconds=RUN_S)
        _, rows = self._live.readings_since(since)
        read_s, depth_mm = rows["time_s"].copy(), rows["depth_mm"].copy()
        if not depth_mm.min() > 0:
            raise InputError(
                f"expected a tool that stays on the soft wall, got one that left it under "
                f"{peak_n:.2f} N of sines; see that nothing moves it, or hangs on it, and begin "
                "again."
            )
        # The servo's ticks lie whole periods before a reading.
        after = read_s[np.minimum(np.searchsorted(read_s, times), read_s.size - 1)]
        ticks = np.floor(np.maximum(0, after - times) / self._period_s)
        used = read_s >= (after - ticks * self._period_s)[0]
        return Run(
            time_s=read_s[used],
            depth_mm=depth_mm[used],
            pressed_s=after - ticks * self._period_s,
            press_n=forces,
            peak_n=peak_n,
        )


def sines(rng: np.random.Generator, *, peak_n: float) -> Callable[[float], float]:
    """Equal sines at random phases, with this peak."""
    turns = 2 * pi * np.array(TONES_HZ)
    phases = rng.uniform(0, 2 * pi, turns.size)
    grid = np.arange(0, RUN_S, 1e-3)
    most = np.abs(np.sin(np.outer(grid, turns) + phases).sum(axis=1)).max()
    return lambda time_s: float(peak_n / most * np.sin(turns * time_s + phases).sum())


def damping_of(runs: Sequence[Run], *, stiffness_n_per_mm: float, period_s: float) -> Damping:
    """Damping, mass and delay by least squares at the sines' frequencies, each run by itself.

    Parameters
    ----------
    runs : sequence of Run
        Independent ones, four or more, with two different peaks.
    stiffness_n_per_mm : float
        Of the wall.
    period_s : float
        Of the servo.

    Raises
    ------
    InputError
        If the motion does not follow from the force by a mass, viscous damping and that wall, or
        not well enough to say by which.

    Notes
    -----
    Dry friction acts like a damper that grows as the motion shrinks, so that the two peaks tell it
    from viscous damping, which alone counts for passivity at any motion.
    """
    fits = [_fitted(run, stiffness_n_per_mm=stiffness_n_per_mm, period_s=period_s) for run in runs]
    coherence = min(fit.coherence for fit in fits)
    if not coherence >= LEAST_COHERENCE:
        raise InputError(
            f"expected a motion of which {LEAST_COHERENCE:.0%} follow from the force, got "
            f"{max(0.0, coherence):.0%}; let go of the tool, see that it touches nothing and moves "
            "freely, and begin again."
        )
    found, mass, delay, stiffness = np.array([fit.values for fit in fits]).T
    wall, rendered = 1e3 * stiffness_n_per_mm, _mean(stiffness)
    if not is_commanded(rendered.value, wall, within=rendered.half):
        raise InputError(
            f"expected about {wall / 1e3:.3g} N/mm of the soft wall, as commanded, got "
            f"{rendered.value / 1e3:.3g} N/mm; let go of the tool, see that it touches nothing "
            "else, and begin again."
        )
    damping, dry = _separated(found, np.array([_dryness(run) for run in runs]))
    weight = _mean(mass)
    if not (damping.identified and weight.identified):
        raise InputError(
            f"expected viscous damping and mass above 0 and known to within {WIDEST:.0%}, got "
            f"{damping} N·s/m and {weight} kg, with a dry friction of {dry} N; see that nothing "
            "shakes the device, begin again, or leave force.damping as it is."
        )
    return Damping(
        damping_n_s_per_m=damping,
        dry_n=dry,
        mass_kg=weight,
        delay_ms=_mean(1e3 * delay),
        coherence=coherence,
    )


def _dryness(run: Run) -> float:
    """By what dry friction of 1 N adds to the damping of a run (s/m).

    Of all dampers the one nearest to sign(v), in the mean square, has ⟨|v|⟩/⟨v²⟩.
    """
    over = max(1, round(_SMOOTHED_S / float(np.diff(run.time_s).mean())))
    way_m = 1e-3 * (run.depth_mm[over:] - run.depth_mm[:-over])
    speed = way_m / (run.time_s[over:] - run.time_s[:-over])
    return float(np.abs(speed).mean() / max(1e-12, float((speed**2).mean())))


def _separated(found: Floats, dryness: Floats) -> tuple[Bounded, Bounded]:
    """Viscous damping and dry friction: intercept and slope over the runs' dryness."""
    from scipy import stats

    rows = np.column_stack([np.ones_like(dryness), dryness])
    values = np.linalg.lstsq(rows, found, rcond=None)[0]
    left = found.size - 2
    variance = float(np.sum((found - rows @ values) ** 2)) / left
    halves = stats.t.ppf(0.975, left) * np.sqrt(variance * np.diag(np.linalg.pinv(rows.T @ rows)))
    viscous, dry = (
        Bounded(value=float(v), half=float(h)) for v, h in zip(values, halves, strict=True)
    )
    return viscous, dry


def _mean(values: Floats) -> Bounded:
    """Mean of independent values, with Student's interval."""
    from scipy import stats

    half = float(stats.t.ppf(0.975, values.size - 1) * values.std(ddof=1) / sqrt(values.size))
    return Bounded(value=float(values.mean()), half=half)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Fit:
    """Damping (N·s/m), mass (kg), delay (s) and stiffness (N/m) of one run; its coherence."""

    values: Floats
    coherence: float


def _fitted(run: Run, *, stiffness_n_per_mm: float, period_s: float) -> _Fit:
    """One run: m z″ + b z′ = p − K z and a constant, over a window of any beginning and end.

    The Fourier integral over a window of T at multiples of 1/T leaves of the constant nothing, and
    of the ends α + jωβ: the change of speed and depth between them.
    """
    from scipy.optimize import least_squares

    length_s = float(run.time_s[-1] - run.time_s[0])
    counts = np.round(np.array(TONES_HZ) * length_s).astype(int)
    depth, force, noise = _spectra(run, counts)
    jw = 2j * pi * counts / length_s
    held = (1 - np.exp(-jw * period_s)) / (jw * period_s)  # a reading is answered for a period
    scale = 1 / np.hypot(noise, _RELATIVE * np.abs(depth))

    def modelled(p: Floats) -> Complexes:
        late = np.exp(-jw * p[2])
        given = force * late + p[4] + jw * p[5]
        moved: Complexes = given / (p[1] * jw**2 + p[0] * jw + p[3] * held * late)
        return moved

    def errors(p: Floats) -> Floats:
        error = (modelled(p) - depth) * scale
        return np.concatenate([error.real, error.imag])

    # Linear in all but the delay; weighted as if each equation's error were one of depth.
    wall = 1e3 * stiffness_n_per_mm
    rows = np.column_stack([jw * depth, jw**2 * depth, held * depth, -np.ones_like(jw), -jw])
    weight = (scale / np.abs(0.2 * jw**2 + jw + wall))[:, None]
    left = np.vstack([(rows * weight).real, (rows * weight).imag])
    right = np.concatenate([(force * weight[:, 0]).real, (force * weight[:, 0]).imag])
    b, m, k, *ends = np.linalg.lstsq(left, right, rcond=None)[0]
    start = np.array([max(b, 0.1), max(m, 0.01), 0.0, max(k, wall / 10), *ends])
    sizes = np.array([1.0, 0.1, 1e-3, wall, *(np.abs(ends) + 1e-6)])
    best = least_squares(errors, start, x_scale=sizes, max_nfev=200)
    error = float(np.sum(np.abs(modelled(best.x) - depth) ** 2))
    motion = float(np.sum(np.abs(depth) ** 2))
    return _Fit(values=best.x[:4], coherence=1 - error / motion if best.success else 0.0)


def _spectra(run: Run, counts: Counts) -> tuple[Complexes, Complexes, float]:
    """Fourier integrals over the run at so many turns in it: depth (m s), and force (N s), which
    is held; and the size of depth's where nothing pushes."""
    time_s = run.time_s - run.time_s[0]
    length_s, depth_m = float(time_s[-1]), 1e-3 * run.depth_mm
    # The trapezoidal rule is exact for all frequencies that the sampling shows.
    weights = (np.diff(time_s, append=length_s) + np.diff(time_s, prepend=0.0)) / 2
    still = np.round(np.arange(*_STILL_HZ) * length_s).astype(int)
    waves = _waves(time_s, length_s, still.max())
    depth = (weights * depth_m) @ waves
    ends = np.interp(time_s, [0.0, length_s], depth_m[[0, -1]])
    noise = (weights * (depth_m - ends)) @ waves[:, still]
    edges = np.clip(np.append(run.pressed_s - run.time_s[0], length_s), 0.0, length_s)
    turned = np.diff(_waves(edges, length_s, counts.max()), axis=0)[:, counts]
    force: Complexes = -(run.press_n @ turned) / (2j * pi * counts / length_s)
    return depth[counts], force, float(np.sqrt(np.mean(np.abs(noise) ** 2)))


def _waves(time_s: Floats, length_s: float, most: int) -> Complexes:
    """e^(−2πj n t/T) for n from 0 on, (times, n): as powers, a tenth of exponentials' time."""
    turning: Complexes = np.exp(-2j * pi / length_s * time_s)
    powers: Complexes = np.vander(turning, most + 1, increasing=True)
    return powers
