"""From a recording to a spectrum (docs/method/recordings.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.sinusoids import Sinusoids, find_sinusoids, without_hum
from tactileq.modeling.reprs import one_line

MODEL_RATE_HZ = 5000.0
HIGH_PASS_HZ = 10.0
SMOOTHING_HZ = 30.0
TAPERED_SHARE = 0.1
TONE_LINES = 2.0
HUM_LINES = 2.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Magnitude spectrum in g per unit noise.

    Parameters
    ----------
    frequency_hz : (n,) ndarray
        0 … rate/2, evenly spaced by rate/n_samples.
    magnitude : (n,) ndarray
        |FFT| divided by the mean |FFT| of unit white noise of the same length, √(πN)/2: white noise
        of RMS r has a magnitude of mean r, whatever the record's length.
    n_samples : int
        N, the number of samples behind it.
    averaged : float
        How many records of that length it is the mean of, ≥ 1.
    share : (n,) ndarray or 1
        Of each line's power, what subtracting the sensor's floor has left, 0…1.
    tapered_magnitude : (n,) ndarray, optional
        The same of the record faded in and out: what is fitted to, since a rectangular window
        leaks loud bands into quiet ones. Pure tones are in it as bands of noise two lines wide,
        of the same power: what a layer can describe.
    notes : tuple of str
        What was found and corrected in the record, one phrase each.
    """

    frequency_hz: Floats
    magnitude: Floats
    rate_hz: float
    n_samples: int
    averaged: float = 1.0
    share: Floats | float = 1.0
    tapered_magnitude: Floats | None = None
    notes: tuple[str, ...] = ()

    __repr__ = one_line

    @property
    def without_leakage(self) -> Floats:
        """The tapered magnitude, (n,), where there is one, else the magnitude itself."""
        return self.magnitude if self.tapered_magnitude is None else self.tapered_magnitude

    @cached_property
    def smoothed_without_leakage(self) -> Floats:
        """`without_leakage`, (n,), smoothed as by `smoothed`; every fit and check asks for it."""
        return smooth(self.without_leakage, SMOOTHING_HZ, step_hz=self.rate_hz / self.n_samples)

    @property
    def duration_s(self) -> float:
        """Length of the record behind the spectrum, in seconds."""
        return self.n_samples / self.rate_hz

    def smoothed(self, sigma_hz: float = SMOOTHING_HZ) -> Floats:
        """Gaussian-smoothed magnitude, reflected at the edges; `sigma_hz` in Hz, > 0."""
        return smooth(self.magnitude, sigma_hz, step_hz=self.rate_hz / self.n_samples)


def smooth(magnitude: Floats, sigma_hz: float, *, step_hz: float) -> Floats:
    """Gaussian smoothing of (…, n) magnitudes spaced by `step_hz`, reflected at the edges."""
    from scipy.ndimage import gaussian_filter1d

    smoothed: Floats = gaussian_filter1d(magnitude, sigma_hz / step_hz, mode="reflect")
    return smoothed


def prepare(recording: Recording, *, rate_hz: float = MODEL_RATE_HZ) -> Floats:
    """Mean removed, resampled by FFT, 10 Hz high-pass (4th-order Butterworth, one direction).

    Parameters
    ----------
    rate_hz : float
        Target rate; data of a lower rate keep their own.

    Returns
    -------
    (n,) ndarray
        In the recording's unit, at min(rate_hz, recording.rate_hz); n ≥ 64.
    """
    from scipy.signal import resample, sosfilt

    target_hz = min(rate_hz, recording.rate_hz)
    if target_hz <= 2 * HIGH_PASS_HZ:
        raise InputError(
            f"{recording.describe()}: expected a rate above {2 * HIGH_PASS_HZ:g} Hz, got "
            f"{target_hz:g} Hz; record faster."
        )
    samples = recording.samples - recording.samples.mean()
    count = round(samples.size * target_hz / recording.rate_hz)
    if count < 64:
        raise InputError(
            f"{recording.describe()}: expected at least 64 samples at {target_hz:g} Hz, got "
            f"{count}; record longer, or correct its rate of {recording.rate_hz:g} Hz."
        )
    if target_hz != recording.rate_hz:
        samples = resample(samples, count)
    filtered: Floats = sosfilt(_high_pass(target_hz), samples)
    return filtered


def high_pass_response(frequency_hz: Floats, *, rate_hz: float) -> Floats:
    """Magnitude of the high-pass of `prepare`, (n,), at (n,) frequencies in Hz, 0 … rate_hz/2.

    √½ at 10 Hz, and within 0.2 dB of 1 above 15 Hz.
    """
    from scipy.signal import freqz_sos

    _, response = freqz_sos(_high_pass(rate_hz), frequency_hz, fs=rate_hz)
    magnitude: Floats = np.abs(response)
    return magnitude


@lru_cache(maxsize=8)
def _high_pass(rate_hz: float) -> Floats:
    from scipy.signal import butter

    sections: Floats = butter(4, HIGH_PASS_HZ, btype="highpass", fs=rate_hz, output="sos")
    return sections


def spectrum(
    recording: Recording, *, rate_hz: float = MODEL_RATE_HZ, hum_hz: Sequence[float] = ()
) -> Spectrum:
    """The recording's magnitude spectrum at the model rate (rectangular window).

    Parameters
    ----------
    recording : Recording
        At least 64 samples after resampling.
    rate_hz : float
        Model rate; data of a lower rate keep their own.
    hum_hz : sequence of float
        Sinusoids that are no vibration of the texture: each is subtracted, and the lines around
        it have no weight.
    """
    samples = prepare(recording, rate_hz=rate_hz)
    rate_hz = min(rate_hz, recording.rate_hz)
    samples = without_hum(samples, rate_hz, hum_hz)
    return prepared_spectrum(samples, rate_hz, recording, hum_hz=hum_hz)


def prepared_spectrum(
    samples: Floats,
    rate_hz: float,
    recording: Recording,
    *,
    hum_hz: Sequence[float] = (),
    notes: Sequence[str] = (),
) -> Spectrum:
    """As `spectrum`, of (n,) samples that are prepared and without hum already.

    `notes` go before those of the spectrum's own.
    """
    frequency = np.fft.rfftfreq(samples.size, 1 / rate_hz)
    share: Floats | float = 1.0
    if hum_hz:
        apart = np.abs(frequency[:, None] - np.asarray(hum_hz)).min(axis=1)
        share = np.where(apart <= HUM_LINES * frequency[1], 0.0, 1.0)
    tones = find_sinusoids(samples, rate_hz, lowest_hz=HIGH_PASS_HZ)
    plain = spectrum_of_samples(samples, rate_hz)
    rest = samples - tones.samples(samples.size, rate_hz)
    faded = spectrum_of_samples(_taper(rest.size) * rest, rate_hz).magnitude
    levels = zip(tones.frequency_hz.tolist(), tones.amplitude.tolist(), strict=True)
    reported = [
        f"pure tone of {a / np.sqrt(2):.3g} {recording.unit} RMS at {f:.1f} Hz" for f, a in levels
    ]
    return replace(
        plain,
        share=share,
        tapered_magnitude=np.sqrt(faded**2 + _as_bands(tones, plain.frequency_hz, samples.size)),
        notes=(*notes, *reported),
    )


@lru_cache(maxsize=8)
def _taper(count: int) -> Floats:
    """Window (n,) that fades a record in and out over a twentieth each (Tukey), of unit power.

    It removes what a rectangular window leaks into quiet bands, at 6 % of the data.
    """
    from scipy.signal.windows import tukey

    window = np.asarray(tukey(count, TAPERED_SHARE), dtype=np.float64)
    faded: Floats = window / np.sqrt(np.mean(window**2))
    return faded


def _as_bands(tones: Sinusoids, frequency_hz: Floats, count: int) -> Floats:
    """Squared magnitude (n,) of narrow bands of noise with the tones' frequencies and powers."""
    squares = np.zeros(frequency_hz.size)
    half_hz = TONE_LINES / 2 * frequency_hz[1]
    for at_hz, amplitude in zip(tones.frequency_hz, tones.amplitude, strict=True):
        band = 1 / (1 + ((frequency_hz - at_hz) / half_hz) ** 2)
        # |FFT|² sums to n·(its power)·n/2 over the lines; magnitudes are relative to √(πn)/2.
        squares += amplitude**2 / 2 * (2 * count / np.pi) * band / band.sum()
    return squares


def spectrum_of_samples(samples: Floats, rate_hz: float) -> Spectrum:
    """Spectrum of (n,) samples as they are, in their unit per unit noise."""
    scale = np.sqrt(np.pi * samples.size) / 2
    return Spectrum(
        np.asarray(np.fft.rfftfreq(samples.size, 1 / rate_hz), dtype=np.float64),
        np.abs(np.fft.rfft(samples)) / scale,
        float(rate_hz),
        samples.size,
    )


def dft321(axes: Floats) -> Floats:
    """Three axes as one signal of the same spectral energy.

    docs/method/recordings.md#three-axes

    Parameters
    ----------
    axes : (3, n) ndarray
        Acceleration along x, y and z in one unit.

    Returns
    -------
    (n,) ndarray
        Its magnitude spectrum is √(|X|² + |Y|² + |Z|²), its phase that of X + Y + Z (Landin,
        Romano, McMahan and Kuchenbecker 2010, "Dimensional reduction of high-frequency
        accelerations for haptic rendering").
    """
    spectra = np.fft.rfft(axes, axis=1)
    magnitude = np.sqrt((np.abs(spectra) ** 2).sum(axis=0))
    combined: Floats = np.fft.irfft(
        magnitude * np.exp(1j * np.angle(spectra.sum(axis=0))), n=axes.shape[1]
    )
    return combined


def mean_spectrum(spectra: list[Spectrum]) -> Spectrum:
    """Average of repeats of one condition, weighted by length, on the longest one's frequencies.

    The averaged magnitudes keep their mean, so gains are unbiased; `n_samples` stays that of the
    longest record, since it sets the spacing of the frequencies.
    """
    longest = max(spectra, key=lambda s: s.n_samples)
    if len(spectra) == 1:
        return longest
    lengths = [s.n_samples for s in spectra]

    def average(name: Literal["magnitude", "share", "without_leakage"]) -> Floats:
        values = [
            np.interp(longest.frequency_hz, s.frequency_hz, s.magnitude * 0 + getattr(s, name))
            for s in spectra
        ]
        return np.asarray(np.average(values, axis=0, weights=lengths), dtype=np.float64)

    records = sum(lengths) ** 2 / sum(length**2 for length in lengths)
    return replace(
        longest,
        magnitude=average("magnitude"),
        share=average("share"),
        tapered_magnitude=average("without_leakage"),
        averaged=records,
    )


def subtract_floor(spectrum: Spectrum, floor: Spectrum) -> Spectrum:
    """The spectrum less a no-contact recording's smoothed floor, in power, at least 0."""
    level = np.interp(spectrum.frequency_hz, floor.frequency_hz, floor.smoothed())
    # Rayleigh-distributed bins: E|X|² = (4/π)(E|X|)², alike in both, so means subtract in power.
    smoothed = np.maximum(spectrum.smoothed(), 1e-300)
    share = np.maximum(1 - (level / smoothed) ** 2, 0.0)
    return replace(
        spectrum,
        magnitude=spectrum.magnitude * np.sqrt(share),
        tapered_magnitude=spectrum.without_leakage * np.sqrt(share),
        share=spectrum.share * share,
    )
