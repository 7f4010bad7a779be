"""The content of the spectral figures, computed beforehand: figures only draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import (
    PEQ,
    InputError,
    Recording,
    Simplification,
    Spectrum,
    TextureModel,
    Threshold,
    find_layers,
)
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.errors import shown
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.by_power import power_changes
from tactileq.modeling.perception.signs_of_rest import SignsOfRest
from tactileq.modeling.perception.verdicts import CriterionName
from tactileq.modeling.recordings.spectrum import (
    SMOOTHING_HZ,
    high_pass_response,
    mean_spectrum,
    smooth,
)
from tactileq.modeling.reprs import one_line

PANELS_PER_AXIS = 3
THRESHOLD_REACH = 2**0.25  # a layer's threshold is drawn a quarter of an octave to both sides


@dataclass(frozen=True, eq=False)
class SpectrumComparison:
    """One condition: recording, full and simplified model, threshold (PAPER fig. 6).

    Parameters
    ----------
    speed_mm_s, force_n : float
        The condition.
    simulated : bool
        True where no real surface was touched.
    frequency_hz : (n,) ndarray
        0 … rate/2.
    recording, full, simplified : (n,) ndarray
        Magnitudes in g per unit noise, all smoothed alike (Gaussian, σ = 30 Hz). `recording` is
        NaN where there is none; where there is one, both models are behind its 10 Hz high-pass.
    layer_frequency_hz, layer_amplitude_g : (m,) ndarray
        Frequency and amplitude (g peak) of each layer of the full model here, the amplitude by
        `criterion`. By energy it is that of the sinusoid of the power that dropping the layer here
        changes (with its peak, or what fills its shape).
    layer_response : (m, n) ndarray
        Each layer's own response |G·H(f)| in g per unit noise, not smoothed.
    layer_threshold : (m, n) ndarray
        The gain (g per unit noise) with which a layer of this width, were it alone, would stand at
        the threshold by `criterion`, a quarter of an octave around the layer, NaN elsewhere and
        where no threshold is known or assumed.
    dropped : (m,) ndarray of bool
        Layers that the simplified model does without.
    threshold : Threshold
        What the layers were compared with.
    hold_above : bool
        Whether its last level was assumed to hold above its end, as a lower bound.
    criterion : str
        Which amplitude was compared with it (docs/method/perception.md#criteria): energy,
        paper-fft or paper-gain.
    """

    texture: str
    speed_mm_s: float
    force_n: float
    simulated: bool
    frequency_hz: Floats
    recording: Floats
    full: Floats
    simplified: Floats
    layer_frequency_hz: Floats
    layer_amplitude_g: Floats
    layer_response: Floats
    layer_threshold: Floats
    dropped: Bools
    threshold: Threshold
    hold_above: bool
    criterion: CriterionName

    __repr__ = one_line


def compare_spectra(
    result: TextureResult, *, speed_mm_s: float, force_n: float
) -> SpectrumComparison:
    """Bring recording, both models and the threshold of one condition together.

    Parameters
    ----------
    speed_mm_s, force_n : float
        A recorded condition.

    Raises
    ------
    InputError
        Where the condition was not recorded.
    """
    compared = compare_condition(
        result.model,
        result.simplification,
        speed_mm_s=speed_mm_s,
        force_n=force_n,
        measured=result.spectrum_at(speed_mm_s, force_n),
    )
    return replace(compared, simulated=result.simulated)


def compare_condition(
    full: TextureModel,
    simplification: Simplification,
    *,
    speed_mm_s: float,
    force_n: float,
    measured: Spectrum | None = None,
) -> SpectrumComparison:
    """Bring both models and the threshold of one condition together, with or without a recording.

    Parameters
    ----------
    simplification : Simplification
        Of `full`.
    speed_mm_s, force_n : float
        Anywhere within the model's grid.
    measured : Spectrum, optional
        Of a recording of this condition, at the model's rate.

    Raises
    ------
    InputError
        For a condition beyond the grid.
    """
    _require_within_grid(full, speed_mm_s, force_n=force_n)
    frequency = np.arange(full.rate_hz // 2 + 1) if measured is None else measured.frequency_hz
    peq, fewer = (m.peq(speed_mm_s, force_n) for m in (full, simplification.model))
    respond = partial(_smoothed_response, frequency_hz=frequency, high_passed=measured is not None)
    return SpectrumComparison(
        texture=full.texture,
        speed_mm_s=speed_mm_s,
        force_n=force_n,
        simulated=full.simulated,
        frequency_hz=frequency,
        recording=np.full(frequency.size, np.nan) if measured is None else measured.smoothed(),
        full=respond(peq),
        simplified=respond(fewer),
        layer_frequency_hz=peq.frequencies_hz,
        layer_amplitude_g=_layer_amplitudes(full, peq, simplification),
        layer_response=np.abs(peq.gains)[:, None] * np.abs(_bands(peq, frequency)),
        layer_threshold=_layer_thresholds(peq, simplification, frequency_hz=frequency),
        dropped=np.array([v.verdict == "dropped" for v in simplification.layers], bool),
        threshold=simplification.threshold,
        hold_above=simplification.hold_above,
        criterion=simplification.criterion,
    )


def _smoothed_response(peq: PEQ, frequency_hz: Floats, *, high_passed: bool) -> Floats:
    """The model's response, smoothed as recordings are (Gaussian, σ = 30 Hz).

    With the high-pass that recordings go through before they are modelled, if so asked.
    """
    response = peq.response(frequency_hz)
    if high_passed:
        response = response * high_pass_response(frequency_hz, rate_hz=peq.rate_hz)
    step_hz = float(frequency_hz[1] - frequency_hz[0])
    return smooth(response, SMOOTHING_HZ, step_hz=step_hz)


def _layer_amplitudes(full: TextureModel, peq: PEQ, simplification: Simplification) -> Floats:
    """Amplitude of each layer by the criterion, (m,), in g peak."""
    if simplification.criterion != "energy":
        return layer_amplitudes_g(peq, criterion=simplification.criterion)
    amplitudes, signs = np.zeros(full.n_layers), SignsOfRest.of_model(full)
    changes = power_changes(peq, simplification.threshold, hold_above=simplification.hold_above)
    for group in own_peaks(full).groups:
        amplitudes[list(group)] = changes.of(signs.without(peq.gains[None], group)).amplitude_g
    return amplitudes


def _layer_thresholds(peq: PEQ, simplification: Simplification, *, frequency_hz: Floats) -> Floats:
    """The threshold as a gain of each layer, (m, n), around its frequency; NaN elsewhere."""
    unit_gains = replace(peq, gains=np.ones(peq.gains.size))
    per_gain = layer_amplitudes_g(unit_gains, criterion=simplification.criterion)
    centres = peq.frequencies_hz[:, None]
    near = (frequency_hz >= centres / THRESHOLD_REACH) & (frequency_hz <= centres * THRESHOLD_REACH)
    threshold = simplification.threshold
    level = (threshold.held if simplification.hold_above else threshold.at)(frequency_hz)
    return np.where(near, level / per_gain[:, None], np.nan)


def _bands(peq: PEQ, frequency_hz: Floats) -> NDArray[np.complex128]:
    return band_response(
        frequency_hz,
        centres_hz=peq.frequencies_hz,
        bandwidths_hz=peq.bandwidths_hz,
        rate_hz=peq.rate_hz,
    )


def _require_within_grid(model: TextureModel, speed_mm_s: float, *, force_n: float) -> None:
    speeds, forces = model.speeds_mm_s, model.forces_n
    if not (speeds[0] <= speed_mm_s <= speeds[-1] and forces[0] <= force_n <= forces[-1]):
        raise InputError(
            f"expected a condition within the grid of {shown(model.texture)}, {speeds[0]:g} to "
            f"{speeds[-1]:g} mm/s and {forces[0]:g} to {forces[-1]:g} N, got {speed_mm_s:g} mm/s "
            f"and {force_n:g} N; choose one inside."
        )


@dataclass(frozen=True, eq=False)
class SpectrumPanel:
    """The smoothed spectrum of one condition, the layers found in it alone, and the model there.

    Parameters
    ----------
    title : str
        Texture and condition.
    unit : str
        g, or arbitrary.
    frequency_hz, magnitude : (n,) ndarray
        Smoothed magnitude (σ = 30 Hz) in `unit` per unit noise.
    layer_frequency_hz, layer_height : (m,) ndarray
        Where the layers are, and the smoothed spectrum's height there.
    response : (n,) ndarray
        The fitted model's response behind the same 10 Hz high-pass, smoothed alike; empty where
        there is no model.
    """

    title: str
    unit: str
    simulated: bool
    frequency_hz: Floats
    magnitude: Floats
    layer_frequency_hz: Floats
    layer_height: Floats
    response: Floats


def spectrum_panels(
    measured: Sequence[tuple[Recording, Spectrum]],
    *,
    estimator: str,
    model: TextureModel | None = None,
) -> tuple[SpectrumPanel, ...]:
    """Panels of some conditions of one texture, by speed and force; no grid is needed.

    Three speeds and three forces at most, spread over what was recorded, both ends in.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        Repeats of a condition are averaged.
    estimator : str
        Finds the layers of each condition alone.
    model : TextureModel, optional
        Fitted to the same recordings.
    """
    by_condition: dict[tuple[float, float], list[tuple[Recording, Spectrum]]] = {}
    for pair in measured:
        by_condition.setdefault(pair[0].condition, []).append(pair)
    shown = _spread_conditions(sorted(by_condition))
    return tuple(_panel(by_condition[c], estimator=estimator, model=model) for c in shown)


def _spread_conditions(conditions: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those at three speeds and three forces; of a scattered few all."""
    if len(conditions) <= PANELS_PER_AXIS**2:
        return list(conditions)
    speeds, forces = (
        {axis[round(i)] for i in np.linspace(0, len(axis) - 1, PANELS_PER_AXIS)}
        for axis in (sorted({v for v, _ in conditions}), sorted({f for _, f in conditions}))
    )
    chosen = [(v, f) for v, f in conditions if v in speeds and f in forces]
    return chosen or list(conditions[: PANELS_PER_AXIS**2])


def _panel(
    repeats: Sequence[tuple[Recording, Spectrum]], *, estimator: str, model: TextureModel | None
) -> SpectrumPanel:
    recording = repeats[0][0]
    measured = mean_spectrum([spectrum for _, spectrum in repeats])
    layers = find_layers(measured, estimator=estimator)
    magnitude = measured.smoothed(SMOOTHING_HZ)
    response = np.zeros(0)
    if model is not None:
        peq = model.peq(*recording.condition)
        response = _smoothed_response(peq, measured.frequency_hz, high_passed=True)
    return SpectrumPanel(
        title=f"{recording.texture}, {recording.speed_mm_s:g} mm/s, {recording.force_n:g} N",
        unit=recording.unit,
        simulated=any(each.simulated for each, _ in repeats),
        frequency_hz=measured.frequency_hz,
        magnitude=magnitude,
        layer_frequency_hz=layers.frequencies_hz,
        layer_height=np.interp(layers.frequencies_hz, measured.frequency_hz, magnitude),
        response=response,
    )
