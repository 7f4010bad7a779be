"""How exact a rendering is while the hand moves: late parameters, levels, clicks."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from analysis.stability import (
    FORMS,
    OURS,
    STROKE_HZ,
    held_variances,
    moving_variances,
    simulate,
)
from modeling import Recording, Renderer, TextureModel, similarity
from modeling.motion import Foresight
from modeling.noise import stream_key, white_noise
from modeling.peq import band_rms
from modeling.plan import RenderPlan
from modeling.table import Parameters

Floats = NDArray[np.float64]
FASTEST_MM_S = 300.0
FORCE_N = 2.0
HELD_MM_S = 200.0
UPDATES_SAMPLES = (1, 5, 32)
# How often the speed is read (Hz), and the noise of a reading (mm/s).
READINGS = (
    *((1000.0, noise) for noise in (0.0, 1.0, 2.0, 5.0, 10.0)),
    *((rate, 2.0) for rate in (500.0, 250.0, 125.0)),
)


class Hand(NamedTuple):
    """Speed (mm/s, signed) and force (N) at each of n samples."""

    speed_mm_s: Floats
    force_n: Floats


def stroke(rate_hz: float, *, duration_s: float = 1.0) -> Hand:
    """A hand that goes to and fro at 2 Hz, up to 300 mm/s, pressing with 2 N."""
    time_s = np.arange(round(duration_s * rate_hz)) / rate_hz
    speed = FASTEST_MM_S * np.sin(2 * np.pi * STROKE_HZ * time_s)
    return Hand(speed, np.full(speed.size, FORCE_N))


def update_error_db(
    model: TextureModel,
    hand: Hand,
    update_samples: int,
    *,
    seed: int = 0,
    readings: Hand | None = None,
) -> float:
    """RMS difference from a rendering with an update at every sample, dB re that rendering.

    `readings` are what is known of the hand where that is not the hand itself.
    """
    rendered = Renderer(model, seed=seed, update_samples=update_samples).render(*(readings or hand))
    exact = Renderer(model, seed=seed, update_samples=1).render(*hand)
    return float(10 * np.log10(np.mean((rendered - exact) ** 2) / np.mean(exact**2)))


def reading_rows(model: TextureModel) -> list[dict[str, object]]:
    """Errors where the speed is read with noise, or seldom, with updates every 1 and 5 samples."""
    hand, rows = stroke(model.rate_hz), list[dict[str, object]]()
    noise = np.random.default_rng(0).normal(0, 1, hand.speed_mm_s.size)
    at = np.arange(noise.size)
    for reading_hz, noise_mm_s in READINGS:
        period = round(model.rate_hz / reading_hz)
        speed = (hand.speed_mm_s + noise_mm_s * noise)[at // period * period]
        readings = Hand(speed, hand.force_n)
        row: dict[str, object] = {"reading_hz": reading_hz, "noise_mm_s": noise_mm_s}
        for name, update in (("every_1", 1), ("every_5", 5), ("as_read", period)):
            row[f"error_db_{name}"] = update_error_db(model, hand, update, readings=readings)
        rows.append(row | {"simulated": True})
    return rows


def rendered_parameters(model: TextureModel, hand: Hand, update_samples: int) -> Parameters:
    """The parameters that a renderer at the model's rate applies at each sample (METHOD 9).

    Frequencies and widths are held from update to update; gains move.
    """
    plan = RenderPlan(rate_hz=model.rate_hz, update_samples=update_samples)
    readings = (reading[::update_samples] for reading in hand)
    amid, end = (model.parameters(*foreseen) for foreseen in Foresight(plan)(*readings))
    gains = np.column_stack([end.noise_gain, end.gains])
    reached = [gains[0], *gains]
    for n in range(1, len(reached)):
        slews = plan.slews(model.table.largest_gains)
        reached[n] = reached[n - 1] + np.clip(reached[n] - reached[n - 1], -slews, slews)
    passed = np.arange(1, update_samples + 1)[:, None] / update_samples
    course = np.concatenate([a + (b - a) * passed for a, b in pairwise(reached)])
    count = hand.speed_mm_s.size
    held = np.arange(count) // update_samples
    return Parameters(
        course[:count, 0],
        amid.frequencies_hz[held],
        amid.bandwidths_hz[held],
        course[:count, 1:],
    )


class LevelErrors(NamedTuple):
    """How far a moving rendering's level is from the model's own at the speed of each sample.

    `within_grid_db`: largest absolute error in dB while speed and force are on the grid.
    `below_grid`: largest error of the RMS below it, as a share of the RMS on its edge (dB say
    nothing where the level goes to 0).
    """

    within_grid_db: float
    below_grid: float


def level_errors(model: TextureModel, hand: Hand, update_samples: int) -> LevelErrors:
    """Exact levels of a rendering along a stroke against those of the model held there.

    For one force on the grid.
    """
    rendered = rendered_parameters(model, hand, update_samples)
    level, wanted = (
        np.sqrt(variances.total)
        for variances in (
            moving_variances(rendered, FORMS[OURS], rate_hz=model.rate_hz),
            held_variances(model.parameters(*hand), FORMS[OURS], rate_hz=model.rate_hz),
        )
    )
    below = np.abs(hand.speed_mm_s) < model.speeds_mm_s[0]
    edge = model.parameters(model.speeds_mm_s[:1], hand.force_n[:1])
    at_edge = np.sqrt(held_variances(edge, FORMS[OURS], rate_hz=model.rate_hz).total[0])
    return LevelErrors(
        float(np.abs(20 * np.log10(level[~below] / wanted[~below])).max()),
        float(np.abs(level - wanted)[below].max(initial=0.0) / at_edge),
    )


def held_gfc30(model: TextureModel, speed_mm_s: float, *, seed: int = 0) -> tuple[float, float]:
    """GFC30 of the second after a stroke in which the speed is held, and its ceiling."""
    renderer = Renderer(model, seed=seed)
    renderer.render(*stroke(model.rate_hz, duration_s=0.6))
    held = renderer.render(speed_mm_s, FORCE_N, samples=round(model.rate_hz))
    recording = Recording(held, model.rate_hz, speed_mm_s, FORCE_N, model.texture, simulated=True)
    report = similarity.report(recording, model)
    return report.gfc30, report.ceiling_gfc30


def accuracy_row(model: TextureModel) -> dict[str, object]:
    """All measures of one texture along a 2 Hz stroke, with updates every 1, 5 and 32 samples."""
    hand = stroke(model.rate_hz)
    row: dict[str, object] = {"texture": model.texture}
    for period in UPDATES_SAMPLES:
        errors = level_errors(model, hand, period)
        row[f"level_error_db_every_{period}"] = errors.within_grid_db
        row[f"level_error_below_grid_every_{period}"] = errors.below_grid
        if period > 1:
            row[f"error_db_every_{period}"] = update_error_db(model, hand, period)
    gfc30, ceiling = held_gfc30(model, HELD_MM_S)
    return row | {"gfc30": gfc30, "ceiling_gfc30": ceiling, "simulated": True}


# --- Clicks

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
    return np.stack([Renderer(model, stream=i).render(*hand) for i in range(streams)])


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
