"""A vibrator's resonance from a test with white noise (docs/method/vibrators.md#identification).

The transfer from drive to acceleration is fitted by one layer, with the likelihood of the layers
estimator (docs/method/estimation.md#likelihood).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError
from tactileq.modeling.estimation.given_count import fit_layer_count
from tactileq.modeling.estimation.likelihood import EMPTY_BELOW_DB, HIGHEST_SHARE, LOWEST_FITTED_HZ
from tactileq.modeling.recordings.recording import clipped_samples
from tactileq.modeling.recordings.spectrum import HIGH_PASS_HZ, MODEL_RATE_HZ, Spectrum
from tactileq.modeling.vibrators.compensation import FLAT_WITHIN_DB
from tactileq.modeling.vibrators.vibrator import Vibrator

SEGMENTS = 32
# Hann windows that overlap by half share 1/6 of their information (Welch 1967).
INDEPENDENT_SEGMENTS = SEGMENTS / (1 + 2 / 36)
# A line's magnitude is known to √((1 − γ²)/2nγ²) (Bendat and Piersol 2010): 0.5 dB with n = 30 at a
# coherence γ² of 0.8. Further down most of what is heard is something else than the vibrator.
LEAST_COHERENCE = 0.8
SHORTEST_SEGMENT_S = 0.5
# The window smears a peak of width B over 1.5/T: at BT = 8 that costs 0.2 dB of its height.
LEAST_WIDTH_LINES = 8.0
MOST_CLIPPED_SHARE = 0.01
LEAST_RATE_HZ = 200.0
LARGEST_VALUE = 1e50  # and its inverse the smallest peak, so that no square overflows
# More than that above a flat part is a fit without any flat part in its band.
HIGHEST_RESONANCE_DB = 40.0
# The band in which one layer describes a vibrator: further down it rolls off as a mass on a spring,
# further up as its coil and its housing will have it.
BAND_SHARES = (0.5, 4.0)
CURVE_STEPS_PER_OCTAVE = 48


def identify_vibrator(
    drive: ArrayLike, acceleration: ArrayLike, *, rate_hz: float, simulated: bool = False
) -> Vibrator:
    """The resonance of a vibrator from a test with white noise.

    The transfer (H1 estimate: noise of the sensor does not bias it) is fitted from an octave below
    its peak to two octaves above; a line counts as far as the drive explains it.

    Parameters
    ----------
    drive, acceleration : (n,) array_like
        Recorded together, 8.25 s at least, in any units; longer where the resonance is narrow.
        Rates above 5 kHz are resampled.
    simulated : bool
        Whether no real vibrator was tested.

    Raises
    ------
    InputError
        For records that are no such test, poor coherence, or no resonance above a flat part.
    """
    transfer = _transfer(*_checked(drive, acceleration, rate_hz=rate_hz), rate_hz=rate_hz)
    curves = transfer.curves()
    centre_hz, lowest_hz, highest_hz = _band(curves)
    coherence = _checked_coherence(curves, centre_hz, within_hz=(lowest_hz, highest_hz))
    layer = transfer.one_layer(lowest_hz, highest_hz)
    height = 1 + float(layer.gains[0]) / layer.noise_gain
    _check_resonance(layer, height, transfer=transfer)
    return Vibrator(
        rate_hz=transfer.rate_hz,
        frequency_hz=float(layer.frequencies_hz[0]),
        bandwidth_hz=float(layer.bandwidths_hz[0]),
        height=height,
        flat_gain=layer.noise_gain,
        coherence=coherence,
        lowest_hz=lowest_hz,
        highest_hz=highest_hz,
        curve_hz=curves[0],
        curve_response=curves[1],
        curve_coherence=curves[2],
        simulated=simulated,
    )


@dataclass(frozen=True, eq=False)
class _Transfer:
    """|H1| and coherence, (n,) each, at the lines of a segment of so many samples."""

    frequency_hz: Floats
    magnitude: Floats
    coherence: Floats
    rate_hz: float
    segment_samples: int

    @property
    def step_hz(self) -> float:
        return self.rate_hz / self.segment_samples

    def curves(self) -> Floats:
        """Frequency, magnitude and coherence (3, n) by 1/48 octave, or by line where wider."""
        within = (self.frequency_hz >= HIGH_PASS_HZ) & (
            self.frequency_hz <= HIGHEST_SHARE * self.rate_hz / 2
        )
        frequency = self.frequency_hz[within]
        step = np.floor(CURVE_STEPS_PER_OCTAVE * np.log2(frequency / HIGH_PASS_HZ))
        starts = np.flatnonzero(np.diff(step, prepend=-1.0))
        lines = np.diff(np.append(starts, frequency.size))
        values = (frequency, self.magnitude[within] ** 2, self.coherence[within])
        middle, power, coherence = (np.add.reduceat(v, starts) / lines for v in values)
        return np.stack([middle, np.sqrt(power), coherence])

    def one_layer(self, lowest_hz: float, highest_hz: float) -> PEQ:
        """The likeliest single layer between two frequencies."""
        used = (self.frequency_hz >= lowest_hz) & (self.frequency_hz <= highest_hz)
        # Weighted line by line, those would count most that read high by chance.
        steps_hz, _, coherence = self.curves()
        share = np.interp(self.frequency_hz, steps_hz, coherence)
        # The estimator takes magnitudes for Rayleigh-distributed ones, averaged over records.
        as_average = np.sqrt(1 + (4 / np.pi - 1) / SEGMENTS)
        spectrum = Spectrum(
            self.frequency_hz,
            self.magnitude * as_average,
            self.rate_hz,
            self.segment_samples,
            averaged=float(SEGMENTS),
            share=np.where(used, share, 0.0),
        )
        return fit_layer_count(spectrum, 1)


def _transfer(drive: Floats, acceleration: Floats, *, rate_hz: float) -> _Transfer:
    """H1 = S_xy/S_xx and γ² = |S_xy|²/(S_xx·S_yy) over 32 segments (Hann, half overlapping).

    Chance correlates n segments of anything: it adds (1 − γ²)/(n − 1) of the response's power to
    |H1|², (1 − γ²)²/n to γ² (Carter, Knapp and Nuttall 1973). Both are taken out again.
    """
    from scipy.signal import csd  # late: takes longer to load than all of modeling

    # Each relative to its own peak, so that no unit overflows.
    peaks = [np.abs(record).max() for record in (drive, acceleration)]
    x, y = (_resampled(r / p, rate_hz) for r, p in zip((drive, acceleration), peaks, strict=True))
    rate_hz = min(rate_hz, MODEL_RATE_HZ)
    segment = int(2 * x.size / (SEGMENTS + 1))

    def density(a: Floats, b: Floats) -> NDArray[np.complex128]:
        return np.asarray(csd(a, b, fs=rate_hz, nperseg=segment)[1], dtype=np.complex128)

    of_drive, of_response, cross = density(x, x).real, density(y, y).real, np.abs(density(x, y))
    # Where there is no drive, the transfer is anything and the coherence may be leakage.
    driven = of_drive >= of_drive.max() * 10 ** (EMPTY_BELOW_DB / 10)
    driven &= of_drive * of_response > 0
    coherence = np.zeros(cross.size)
    np.divide(cross**2, of_drive * of_response, out=coherence, where=driven)
    by_chance = (1 - coherence) / (INDEPENDENT_SEGMENTS - 1)
    explained = np.maximum(coherence - by_chance, 0.0) * of_response
    power = np.divide(explained, of_drive, out=np.zeros(cross.size), where=driven)
    coherence = np.clip(coherence - by_chance * (1 - coherence), 0.0, 1.0)
    frequency = np.arange(cross.size, dtype=np.float64) * (rate_hz / segment)
    magnitude = np.sqrt(power) * (peaks[1] / peaks[0])
    return _Transfer(frequency, magnitude, coherence, rate_hz, segment)


def _band(curves: Floats) -> tuple[float, float, float]:
    """Where the response is highest, and the band around it that is fitted."""
    frequency, response, _ = curves[:, curves[0] >= LOWEST_FITTED_HZ]
    centre = float(frequency[np.argmax(response)])
    low, high = np.clip(np.multiply(BAND_SHARES, centre), frequency[0], frequency[-1])
    return centre, float(low), float(high)


def _checked_coherence(
    curves: Floats, centre_hz: float, *, within_hz: tuple[float, float]
) -> float:
    """Median coherence over the band along a logarithmic axis; refused where it is poor."""
    frequency, _, coherence = curves
    median = float(np.median(np.interp(np.geomspace(*within_hz, 200), frequency, coherence)))
    at_peak = float(np.interp(centre_hz, frequency, coherence))
    if min(median, at_peak) < LEAST_COHERENCE:
        raise InputError(
            f"expected a coherence of drive and acceleration of at least {LEAST_COHERENCE:g}, got "
            f"{median:.2f} from {within_hz[0]:.0f} to {within_hz[1]:.0f} Hz and {at_peak:.2f} at "
            f"the highest response ({centre_hz:.0f} Hz); raise the drive, fix sensor and vibrator "
            "firmly, record both channels together, or record longer."
        )
    return median


def _check_resonance(layer: PEQ, height: float, *, transfer: _Transfer) -> None:
    """Refuse a layer that is no resonance, or one that the record does not resolve."""
    frequency_hz, bandwidth_hz = float(layer.frequencies_hz[0]), float(layer.bandwidths_hz[0])
    height_db = 20 * np.log10(height)
    if not FLAT_WITHIN_DB <= height_db <= HIGHEST_RESONANCE_DB:
        raise InputError(
            f"expected a resonance {FLAT_WITHIN_DB:g} to {HIGHEST_RESONANCE_DB:g} dB above a flat "
            f"part, got {height_db:.1f} dB at {frequency_hz:.0f} Hz; check that the first record "
            "is the drive and the second the acceleration, else there is nothing to compensate."
        )
    lowest_hz, highest_hz = LOWEST_FITTED_HZ * np.sqrt(2), HIGHEST_SHARE * transfer.rate_hz / 4
    if not lowest_hz <= frequency_hz <= highest_hz:
        raise InputError(
            f"expected a resonance within {lowest_hz:.0f} to {highest_hz:.0f} Hz, got the highest "
            f"response at {frequency_hz:.0f} Hz; show the flat part above it by a higher rate, or "
            "mount the vibrator so that it resonates within that band."
        )
    if bandwidth_hz < LEAST_WIDTH_LINES * transfer.step_hz:
        least_s = LEAST_WIDTH_LINES / bandwidth_hz * (SEGMENTS + 1) / 2
        got_s = (SEGMENTS + 1) / 2 / transfer.step_hz
        raise InputError(
            f"expected a test of at least {least_s:.1f} s for a resonance {bandwidth_hz:.2g} Hz "
            f"wide, got {got_s:.1f} s; record longer."
        )


def _checked(drive: ArrayLike, acceleration: ArrayLike, *, rate_hz: float) -> tuple[Floats, Floats]:
    """Both records as arrays without offset; refused where they are no test."""
    check_rate(rate_hz)
    if rate_hz < LEAST_RATE_HZ:
        raise InputError(
            f"expected a test at {LEAST_RATE_HZ:g} Hz at least, got {rate_hz:g} Hz; record faster."
        )
    records = np.asarray(drive, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    shapes = [record.shape for record in records]
    if shapes[0] != shapes[1] or len(shapes[0]) != 1:
        raise InputError(
            f"expected drive and acceleration of one length, got the shapes {shapes[0]} and "
            f"{shapes[1]}; record both together."
        )
    least_s, got_s = SHORTEST_SEGMENT_S * (SEGMENTS + 1) / 2, shapes[0][0] / rate_hz
    if got_s < least_s:
        raise InputError(
            f"expected a test of at least {least_s:g} s, got {got_s:.3g} s; record longer."
        )
    for name, record in zip(("drive", "acceleration"), records, strict=True):
        _check_record(name, record)
    return records[0] - records[0].mean(), records[1] - records[1].mean()


def _check_record(name: str, record: Floats) -> None:
    """Refuse values that are not finite, silence, and clipping."""
    if not np.isfinite(record).all():
        raise InputError(
            f"expected finite samples of the {name}, got {record[~np.isfinite(record)][0]}; record "
            "it again."
        )
    peak = float(np.abs(record).max())
    if not 1 / LARGEST_VALUE <= peak <= LARGEST_VALUE and peak > 0:
        raise InputError(
            f"expected a {name} with a peak of {1 / LARGEST_VALUE:g} to {LARGEST_VALUE:g}, got "
            f"{peak:g}; give it in another unit."
        )
    if record.min() == record.max():
        raise InputError(
            f"expected noise as the {name}, got the constant value {record[0]:g}; check its cable."
        )
    clipped = float(clipped_samples(record).mean())
    if clipped > MOST_CLIPPED_SHARE:
        raise InputError(
            f"expected at most {MOST_CLIPPED_SHARE:.0%} of clipped samples in the {name}, got "
            f"{clipped:.1%}; lower its level."
        )


def _resampled(record: Floats, rate_hz: float) -> Floats:
    """A record at 5 kHz (by FFT, docs/method/recordings.md#preparation), else at its lower rate."""
    if rate_hz <= MODEL_RATE_HZ:
        return record
    from scipy.signal import resample  # late: takes longer to load than all of modeling

    return np.asarray(resample(record, round(record.size * MODEL_RATE_HZ / rate_hz)))
