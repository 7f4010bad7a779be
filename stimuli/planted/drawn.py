"""Random surfaces that behave like real ones: truths without layers, known in closed form.

The spectra of 100 real surfaces, as means, principal curves and their covariance over speed and
force (`spectral_statistics`, with its README). What is drawn from them has no layers to be named:
its peaks widen, merge and change in ways that no power law follows. A model must be as close to the
true magnitude between the recorded conditions as at them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.seeds import generator

RATE_HZ = 1000.0
SPEEDS_MM_S = np.linspace(50.0, 350.0, 7)
FORCES_N = np.linspace(0.5, 3.5, 7)
REFERENCE_SPEED_MM_S = 150.0
REFERENCE_FORCE_N = 1.5
# Cut from a circle of noise this many times as long, so that a record does not begin as it ends.
CIRCLE = 4


@dataclass(frozen=True, eq=False)
class DrawnSurface:
    """One random surface: six scores over speed and force, each of a curve over frequency.

    Parameters
    ----------
    coefficients : (6, 6) ndarray
        Of each score (columns) on 1, a, b, a·b, a² and b², where a = ln(v/150 mm/s) and
        b = ln(F/1.5 N).
    residuals : (7, 7, 6) ndarray
        What each score has besides at the nodes 50…350 mm/s × 0.5…3.5 N; bilinear in between.
    """

    name: str
    coefficients: Floats
    residuals: Floats

    def scores(self, speed_mm_s: float, force_n: float) -> Floats:
        """The six scores, (6,), at one speed (mm/s) and force (N) within the nodes."""
        a = np.log(speed_mm_s / REFERENCE_SPEED_MM_S)
        b = np.log(force_n / REFERENCE_FORCE_N)
        terms = np.array([1.0, a, b, a * b, a * a, b * b])
        residual = _shares(SPEEDS_MM_S, speed_mm_s) @ np.tensordot(
            _shares(FORCES_N, force_n), self.residuals, axes=(0, 1)
        )
        scores: Floats = terms @ self.coefficients + residual
        return scores

    def magnitude(self, frequency_hz: ArrayLike, *, speed_mm_s: float, force_n: float) -> Floats:
        """True magnitude, (n,), in g per unit noise at 1 kHz; flat outside 10–490 Hz.

        Parameters
        ----------
        frequency_hz : (n,) array_like
        speed_mm_s, force_n : float
            Within 50…350 mm/s and 0.5…3.5 N.

        Raises
        ------
        InputError
            For a condition outside, where nothing was measured.
        """
        inside = SPEEDS_MM_S[0] <= speed_mm_s <= SPEEDS_MM_S[-1]
        if not (inside and FORCES_N[0] <= force_n <= FORCES_N[-1]):
            raise InputError(
                f"expected a condition within {SPEEDS_MM_S[0]:g}…{SPEEDS_MM_S[-1]:g} mm/s and "
                f"{FORCES_N[0]:g}…{FORCES_N[-1]:g} N, got {speed_mm_s:g} mm/s and {force_n:g} N; "
                "choose one inside."
            )
        statistics = _statistics()
        level_db = statistics.mean_db + statistics.curves @ self.scores(speed_mm_s, force_n)
        at = np.interp(
            np.asarray(frequency_hz, dtype=np.float64), statistics.frequency_hz, level_db
        )
        return np.asarray(10 ** (at / 20), dtype=np.float64)

    def record(
        self,
        speeds_mm_s: Sequence[float] | Floats = SPEEDS_MM_S,
        forces_n: Sequence[float] | Floats = FORCES_N,
        *,
        duration_s: float = 1.0,
        seed: int = 0,
    ) -> RecordingSet:
        """Simulated recordings at 1 kHz: Gaussian noise shaped by the magnitude of each condition.

        Parameters
        ----------
        speeds_mm_s, forces_n : sequence of float
            Within the range of `magnitude`.
        duration_s : float
            Length of each record, > 0.
        seed : int
            Surfaces of one seed share their noise; give each its own.
        """
        n = round(duration_s * RATE_HZ)
        frequency = np.fft.rfftfreq(CIRCLE * n, 1 / RATE_HZ)
        rng = np.random.default_rng(seed)
        records = []
        for speed, force in ((float(v), float(f)) for v in speeds_mm_s for f in forces_n):
            noise = np.fft.rfft(rng.standard_normal(CIRCLE * n))
            shaped = noise * self.magnitude(frequency, speed_mm_s=speed, force_n=force)
            samples = np.fft.irfft(shaped, CIRCLE * n)[:n]
            records.append(Recording(samples, RATE_HZ, speed, force, self.name, simulated=True))
        return RecordingSet(records)


@dataclass(frozen=True, eq=False)
class AlteredSurface(DrawnSurface):
    """A drawn surface whose curves are shifted in frequency, with resonances and lines added.

    So that its spectra are not combinations of the curves that surfaces are drawn from.

    Parameters
    ----------
    shift : float
        Its spectrum at f is that of the drawn surface at f / shift.
    peaks : (n, 4) ndarray
        Of each peak whose power is added: frequency (Hz) at 150 mm/s, half-power width (Hz),
        height over the spectrum there (dB), and the exponent of its frequency over speed: 0 for a
        resonance, 1 for a line of a spatial wavelength.
    """

    shift: float
    peaks: Floats

    def magnitude(self, frequency_hz: ArrayLike, *, speed_mm_s: float, force_n: float) -> Floats:
        """As of a drawn surface."""
        frequency = np.asarray(frequency_hz, dtype=np.float64)
        centre, width, height_db, exponent = self.peaks.T
        centre = centre * (speed_mm_s / REFERENCE_SPEED_MM_S) ** exponent
        at = {"speed_mm_s": speed_mm_s, "force_n": force_n}
        height = super().magnitude(centre / self.shift, **at) ** 2 * 10 ** (height_db / 10)
        shape = 1 / (1 + ((frequency[..., None] - centre) / (width / 2)) ** 2)
        below = super().magnitude(frequency / self.shift, **at) ** 2
        return np.asarray(np.sqrt(below + shape @ height), dtype=np.float64)


def alter_surface(seed: int) -> AlteredSurface:
    """The drawn surface of this seed, shifted by up to 30 %, with one to three peaks of each kind.

    Resonances lie at 60 to 400 Hz with a Q of 3 to 15, lines at 30 to 150 Hz (at 150 mm/s) and are
    3 to 8 Hz wide; both are 5 to 15 dB above the spectrum.
    """
    drawn, rng = draw_surface(seed), generator([0x60, seed])
    resonances, lines = rng.integers(1, 4, 2)
    centre = np.exp(rng.uniform(np.log(60.0), np.log(400.0), resonances))
    low = np.exp(rng.uniform(np.log(30.0), np.log(150.0), lines))
    width = np.concatenate((centre / rng.uniform(3.0, 15.0, resonances), rng.uniform(3, 8, lines)))
    height = rng.uniform(5.0, 15.0, resonances + lines)
    exponent = np.repeat([0.0, 1.0], [resonances, lines])
    peaks = np.column_stack((np.concatenate((centre, low)), width, height, exponent))
    shift = float(rng.uniform(0.7, 1.3))
    return AlteredSurface(
        f"altered {seed}", drawn.coefficients, drawn.residuals, shift=shift, peaks=peaks
    )


def draw_surface(seed: int) -> DrawnSurface:
    """The random surface of this seed, a whole number of at least 0."""
    statistics, rng = _statistics(), generator([0x5F, seed])
    drawn = rng.multivariate_normal(statistics.mean, statistics.covariance)
    curves = statistics.residual_sd.size
    nodes = rng.standard_normal((SPEEDS_MM_S.size, FORCES_N.size, curves))
    return DrawnSurface(f"drawn {seed}", drawn.reshape(-1, curves), nodes * statistics.residual_sd)


@dataclass(frozen=True, eq=False)
class _Statistics:
    frequency_hz: Floats
    mean_db: Floats
    curves: Floats
    mean: Floats
    covariance: Floats
    residual_sd: Floats


@cache
def _statistics() -> _Statistics:
    curves, coefficients = _table("curves"), _table("coefficients")
    return _Statistics(
        frequency_hz=curves[:, 0],
        mean_db=curves[:, 1],
        curves=curves[:, 2:],
        mean=coefficients[:, 1],
        covariance=coefficients[:, 2:],
        residual_sd=_table("residuals")[:, 1],
    )


def _table(name: str) -> Floats:
    """The numbers of one table; NaN for the names in its first column."""
    file = resources.files("tactileq.stimuli.planted").joinpath(
        "spectral_statistics", f"{name}.tsv"
    )
    with file.open(encoding="utf-8") as lines:
        return np.genfromtxt(lines, delimiter="\t", skip_header=1)


def _shares(nodes: Floats, value: float) -> Floats:
    """Weights (n,) of linear interpolation between nodes."""
    return np.array([np.interp(value, nodes, unit) for unit in np.eye(nodes.size)])
