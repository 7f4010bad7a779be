"""What a step of speed or force adds to a rendering: clicks beside other filters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import butter, sosfiltfilt

from analysis.benches.stability import FORMS, simulate
from modeling import TextureModel, render_many
from modeling.arrays import Floats
from modeling.equalizer.bands import band_rms
from modeling.hand import Hand
from modeling.rendering.noise import stream_key, white_noise

CLICK_HZ = 1000.0
AROUND_S = 0.01
STREAMS = 400
STEP_AT_S = 0.2
AFTER_S = 0.1
LAYER_WIDTH_HZ = 10.0
THIS_RENDERER = "this renderer"
STEADY = "steady"
# From and to: speed (mm/s), force (N).
STEPS = {
    "pressed, 0 → 2 N": ((100.0, 0.0), (100.0, 2.0)),
    "lifted, 2 → 0 N": ((100.0, 2.0), (100.0, 0.0)),
    "faster, 100 → 200 mm/s": ((100.0, 2.0), (200.0, 2.0)),
}


@dataclass(frozen=True, eq=False)
class StepSignals:
    """Renderings of a step of the hand from the same (streams, n) noise.

    Parameters
    ----------
    step : str
        One of `STEPS`.
    time_s : (n,) ndarray
        0 at the step.
    renderings : dict of (streams, n) ndarray
        By method; g, simulated.
    steady : (streams, n) ndarray
        What the hand would have made without the step, or after it: where it is the louder above
        1 kHz.
    """

    step: str
    time_s: Floats
    renderings: dict[str, Floats]
    steady: Floats


def hum(rate_hz: float = 5000.0) -> TextureModel:
    """One layer of 1 g RMS at 1 Hz per mm/s, 10 Hz wide, and no floor.

    Nothing of it covers a click: 100 Hz at 100 mm/s, its skirts above 1 kHz are 28 dB below it.
    """
    shape = (2, 2, 1)
    speeds = np.array([50.0, 350.0])
    return TextureModel(
        texture="hum",
        rate_hz=rate_hz,
        speeds_mm_s=speeds,
        forces_n=np.array([0.5, 3.5]),
        noise_gains=np.zeros(shape[:2]),
        frequencies_hz=np.broadcast_to(speeds[:, None, None], shape),
        bandwidths_hz=np.full(shape, LAYER_WIDTH_HZ),
        gains=np.full(shape, 1 / band_rms(1.0, LAYER_WIDTH_HZ, rate_hz=rate_hz)),
        level_sd_db=np.zeros(shape),
        estimator="planted",
        simulated=True,
    )


def step_signals(step: str, *, streams: int = STREAMS) -> StepSignals:
    """The hum under a hand that steps, rendered here and by filters that are switched at once."""
    model = hum()
    before, after = (round(part * model.rate_hz) for part in (STEP_AT_S, AFTER_S))
    ends = [Hand(*(np.full(before + after, value) for value in end)) for end in STEPS[step]]
    after_step = np.arange(before + after) >= before
    stepping = Hand(*(np.where(after_step, b, a) for a, b in zip(*ends, strict=True)))
    noise = np.stack([white_noise(stream_key(0, i), 0, before + after) for i in range(streams)])
    switched = model.parameters(*stepping)
    renderings = {THIS_RENDERER: _rendered(model, stepping, streams)}
    for name, form in FORMS.items():
        renderings[f"{name}, switched"] = simulate(switched, form, noise, rate_hz=model.rate_hz)
    steady = [_rendered(model, end, streams) for end in ends]
    return StepSignals(
        step,
        (np.arange(before + after) - before) / model.rate_hz,
        renderings,
        max(steady, key=lambda signals: float(np.mean(above_click_hz(signals) ** 2))),
    )


def _rendered(model: TextureModel, hand: Hand, streams: int) -> Floats:
    each = range(streams)
    return np.stack(
        render_many([model] * streams, [hand] * streams, seeds=[0] * streams, streams=each)
    )


def above_click_hz(signals: Floats, *, rate_hz: float = 5000.0) -> Floats:
    """(…, n) signals above 1 kHz, without delay."""
    sections = butter(4, CLICK_HZ, "highpass", fs=rate_hz, output="sos")
    high: Floats = sosfiltfilt(sections, signals, axis=-1)
    return high


def level_above_click_hz(signals: StepSignals) -> dict[str, Floats]:
    """Level above 1 kHz at each moment, RMS over the streams: (n,) dB re the steady layer's."""
    near = np.abs(signals.time_s) <= AROUND_S
    own = np.sqrt(np.mean(above_click_hz(signals.steady)[:, near] ** 2))
    levels = {
        name: np.sqrt(np.mean(above_click_hz(rendered) ** 2, axis=0)) / own
        for name, rendered in {**signals.renderings, STEADY: signals.steady}.items()
    }
    return {name: 20 * np.log10(np.maximum(level, 1e-6)) for name, level in levels.items()}


def click_table(signals: StepSignals) -> pd.DataFrame:
    """What a step adds within 10 ms around it that the layer itself has not.

    A jump puts energy far from the layer, for a moment. So: the RMS over the streams at each
    moment, the largest of them, against the steady layer's, both above 1 kHz (`high_db`) and of the
    second difference (`second_difference_db`). What the row `steady` has is scatter; as much means
    that nothing has been added. And the energy above 1 kHz of those 20 ms in dB re the steady
    layer's own over all frequencies (`energy_db`), which holds the layer's skirts, too: a jump, so
    short, hardly shows there.
    """
    near = np.abs(signals.time_s) <= AROUND_S
    own_rms = np.sqrt(np.mean(signals.steady[:, near] ** 2))
    rows = []
    for name, rendered in {**signals.renderings, STEADY: signals.steady}.items():
        high, bent = (
            (change(rendered)[:, near], change(signals.steady)[:, near])
            for change in (above_click_hz, _second_difference)
        )
        rows.append(
            {
                "step": signals.step,
                "rendering": name,
                "high_db": _loudest_db(*high),
                "second_difference_db": _loudest_db(*bent),
                "energy_db": 20 * np.log10(np.sqrt(np.mean(high[0] ** 2)) / own_rms),
                "simulated": True,
            }
        )
    return pd.DataFrame(rows)


def _second_difference(signals: Floats) -> Floats:
    return np.diff(signals, 2, axis=-1, prepend=signals[..., :1], append=signals[..., -1:])


def _loudest_db(signals: Floats, steady: Floats) -> float:
    """The largest RMS over the streams at one moment against the steady signals', in dB."""
    at_each_moment = np.sqrt(np.mean(signals**2, axis=0))
    return float(20 * np.log10(at_each_moment.max() / np.sqrt(np.mean(steady**2))))
