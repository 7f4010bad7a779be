"""One stimulus: rendered at its model's rate, brought to the file's rate, faded, encoded."""

from __future__ import annotations

import io
from fractions import Fraction
from math import ceil

import numpy as np
from scipy.io import wavfile

from tactileq.modeling import Compensation, Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.recordings.trajectory import Trajectory
from tactileq.stimuli.sets.recipe import SampleFormat

FADE_S = 0.01
# Rendered beyond both ends and faded to 0 there, so that the resampling's circle has no seam.
MARGIN_S = 0.1
# Ratios of rates such as 441/50 are exact; odd ones are met within 2 parts in a million.
LARGEST_DENOMINATOR = 10_000
PCM24_STEPS = 2**23
BITS: dict[SampleFormat, int] = {"float32": 32, "pcm24": 24}


def render_with_margins(
    model: AnyModel, trajectory: Trajectory, *, seed: int, stream: int, settling_s: float
) -> Floats:
    """The vibration of a stroke at the model's rate, with what comes before and after it.

    Rendering begins `settling_s` and `MARGIN_S` before the start, with the first condition held,
    while the filters settle, and goes on for `MARGIN_S` after the end. Not rendered at the file's
    rate, since a filter warps less there and its skirts near the model's Nyquist frequency rise
    (see `Renderer`): so every rate has the same spectrum.

    Returns
    -------
    (n,) ndarray
        In the model's unit; ⌈duration·rate⌉ samples from the start (`start_sample`) to the end.
    """
    rate_hz, start = model.rate_hz, start_sample(model.rate_hz, settling_s=settling_s)
    count = start + ceil(trajectory.duration_s * rate_hz) + margin_samples(rate_hz)
    speed, force = trajectory.at((np.arange(count) - start) / rate_hz)
    return Renderer(model, seed=seed, stream=stream).render(speed, force)


def start_sample(rate_hz: float, *, settling_s: float) -> int:
    """Where a stroke begins in what `render_with_margins` returns."""
    return round(settling_s * rate_hz) + margin_samples(rate_hz)


def margin_samples(rate_hz: float) -> int:
    """Samples of one margin at this rate."""
    return round(MARGIN_S * rate_hz)


def at_rate(
    with_margins: Floats,
    model_rate_hz: float,
    *,
    rate_hz: int,
    duration_s: float,
    settling_s: float,
    compensation: Compensation | None = None,
) -> Floats:
    """A stroke with its margins, resampled to a file's rate, cut to its duration and faded.

    By FFT over a length that the ratio of the rates divides, with zeros up to one of small prime
    factors: exact up to the model's Nyquist frequency, and nothing above it
    (docs/method/recordings.md#preparation: a usual polyphase filter bends the top band by −1.05
    dB). Faded in and out over 10 ms, in files shorter than 40 ms over a quarter of them.

    Parameters
    ----------
    with_margins : (n,) ndarray
        From `render_with_margins`, as is `settling_s`.
    rate_hz : int
        At least `model_rate_hz`.
    compensation : Compensation, optional
        At `rate_hz`: what is returned is the drive of a vibrator (eq. 7). Applied to the margins,
        too, so that it has settled where the file begins if `settling_s` is long enough.

    Returns
    -------
    (round(duration_s·rate_hz),) ndarray
    """
    from scipy.signal import resample  # late: slow to load

    margin = margin_samples(model_rate_hz)
    before = start_sample(model_rate_hz, settling_s=settling_s)
    ratio = Fraction(rate_hz / model_rate_hz).limit_denominator(LARGEST_DENOMINATOR)
    step = ratio.denominator
    pad = -before % step
    end = pad + with_margins.size
    periods = end if ratio == 1 else _fast_length(ceil(end / step))
    circle = np.pad(with_margins, (pad, periods * step - end))
    ends = _ramp(margin)
    circle[pad : pad + margin] *= ends
    circle[end - margin : end] *= ends[::-1]
    if ratio != 1:
        circle = resample(circle, periods * ratio.numerator)
    if compensation is not None:
        circle = compensation.apply(circle)
    start = (pad + before) // step * ratio.numerator
    vibration: Floats = circle[start : start + round(duration_s * rate_hz)]
    return _faded(vibration, rate_hz)


def _fast_length(samples: int) -> int:
    """The next length without large prime factors, with which an FFT takes up to ten times longer.

    The numbers of an exact ratio of rates are small already.
    """
    from scipy.fft import next_fast_len  # late: slow to load

    return int(next_fast_len(samples, real=True))


def fade_samples(samples: int, rate_hz: float) -> int:
    """Length of the fade at each end of a file, in samples."""
    return min(round(FADE_S * rate_hz), samples // 4)


def steady_part(vibration: Floats, rate_hz: float) -> Floats:
    """A file's samples without its fades: over these its level is measured."""
    fade = fade_samples(vibration.size, rate_hz)
    return vibration[fade : vibration.size - fade]


def _faded(vibration: Floats, rate_hz: float) -> Floats:
    faded = vibration.copy()
    ramp = _ramp(fade_samples(vibration.size, rate_hz))
    faded[: ramp.size] *= ramp
    faded[faded.size - ramp.size :] *= ramp[::-1]
    return faded


def _ramp(samples: int) -> Floats:
    """Half a period of a cosine, from 0 to 1."""
    ramp: Floats = 0.5 - 0.5 * np.cos(np.pi * (np.arange(samples) + 0.5) / max(samples, 1))
    return ramp


def highest_peak(full_scale_g: float) -> float:
    """The largest sample that a 24-bit file of this full scale can hold, in g."""
    return full_scale_g * (PCM24_STEPS - 1) / PCM24_STEPS


def wav_bytes(vibration: Floats, rate_hz: int, *, full_scale_g: float | None) -> bytes:
    """A whole WAV file: 32-bit floats in g, or 24-bit steps of full_scale_g/2²³, rounded.

    Nothing in it depends on the clock (a float file of libsndfile's carries the time of writing).
    """
    buffer = io.BytesIO()
    if full_scale_g is None:
        wavfile.write(buffer, rate_hz, vibration.astype(np.float32))
        return buffer.getvalue()
    import soundfile  # late: loads a shared library that most uses never need

    steps = np.rint(vibration * (PCM24_STEPS / full_scale_g))
    # Past the full scale a set is refused; here it must only not wrap around.
    steps = np.clip(steps, -PCM24_STEPS, PCM24_STEPS - 1).astype(np.int32)
    # As whole numbers: libsndfile would scale floats by 2²³ − 1.
    soundfile.write(buffer, steps << 8, rate_hz, format="WAV", subtype="PCM_24")
    return buffer.getvalue()
