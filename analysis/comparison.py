"""What the spectral figures show, computed beforehand: figures only draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.tables import TextureResult
from modeling import InputError, RecordingSet, TextureModel, Threshold, find_layers
from modeling.fitting import condition_spectra
from modeling.simplification import CriterionName, layer_amplitudes_g
from modeling.spectra import SMOOTHING_HZ, smooth

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SpectrumComparison:
    """One recording, its full and simplified model and the detection threshold (PAPER fig. 6).

    Parameters
    ----------
    texture : str
    speed_mm_s, force_n : float
        The condition.
    simulated : bool
        True where no real surface was touched.
    frequency_hz : (n,) ndarray
        0 … rate/2.
    recording, full, simplified : (n,) ndarray
        Magnitudes in g per unit noise, all smoothed alike (Gaussian, σ = 30 Hz).
    layer_frequency_hz, layer_amplitude_g : (m,) ndarray
        Frequency and amplitude (g peak) of each layer of the full model here; the amplitude is
        the one that `criterion` compares with the threshold.
    dropped : (m,) ndarray of bool
        Layers that the simplified model does without.
    threshold : Threshold
        What the layers were held against.
    criterion : str
        Which amplitude was held against it (METHOD 7): energy, paper-fft or paper-gain.
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
    dropped: NDArray[np.bool_]
    threshold: Threshold
    criterion: CriterionName


def compare_spectra(
    result: TextureResult, *, speed_mm_s: float, force_n: float
) -> SpectrumComparison:
    """Bring recording, both models and the threshold of one condition together.

    Parameters
    ----------
    result : TextureResult
    speed_mm_s, force_n : float
        A recorded condition.

    Raises
    ------
    InputError
        Where the condition was not recorded.
    """
    full, simplification = result.model, result.simplification
    measured = result.spectrum_at(speed_mm_s, force_n)
    frequency = measured.frequency_hz

    def smoothed_response(model: TextureModel) -> Floats:
        response = model.peq(speed_mm_s, force_n).response(frequency)
        return smooth(response, SMOOTHING_HZ, step_hz=measured.rate_hz / measured.n_samples)

    at = _grid_index(full, speed_mm_s, force_n=force_n)
    amplitudes_g = layer_amplitudes_g(full, criterion=simplification.criterion)
    return SpectrumComparison(
        texture=full.texture,
        speed_mm_s=speed_mm_s,
        force_n=force_n,
        simulated=result.simulated,
        frequency_hz=frequency,
        recording=measured.smoothed(SMOOTHING_HZ),
        full=smoothed_response(full),
        simplified=smoothed_response(simplification.model),
        layer_frequency_hz=full.frequencies_hz[at],
        layer_amplitude_g=amplitudes_g[at],
        dropped=np.array([v.verdict == "dropped" for v in simplification.layers], bool),
        threshold=simplification.threshold,
        criterion=simplification.criterion,
    )


def _grid_index(model: TextureModel, speed_mm_s: float, *, force_n: float) -> tuple[int, int]:
    speed = np.flatnonzero(model.speeds_mm_s == speed_mm_s)
    force = np.flatnonzero(model.forces_n == force_n)
    if not (speed.size and force.size):
        raise InputError(
            f"expected a condition of the grid of {model.texture!r}, got {speed_mm_s:g} mm/s and "
            f"{force_n:g} N; choose among {model.speeds_mm_s.tolist()} mm/s and "
            f"{model.forces_n.tolist()} N."
        )
    return int(speed[0]), int(force[0])


@dataclass(frozen=True, eq=False)
class LayerCourse:
    """Frequency and amplitude of each layer over speed, at one force.

    Parameters
    ----------
    label : str
        Whose layers these are.
    texture : str
    force_n : float
    simulated : bool
    unit : str
        Of the amplitudes: g, or arbitrary.
    speeds_mm_s : (S,) ndarray
    frequency_hz, amplitude : (S, m) ndarray
        Amplitude of the sinusoid of equal power, √2·G·√(k/(1+k)) (METHOD 7), peak.
    """

    label: str
    texture: str
    force_n: float
    simulated: bool
    unit: str
    speeds_mm_s: Floats
    frequency_hz: Floats
    amplitude: Floats


def layer_course(model: TextureModel, *, force_n: float) -> LayerCourse:
    """Follow the layers of a model over its speeds, at one force (N) of its grid."""
    force = _grid_index(model, float(model.speeds_mm_s[0]), force_n=force_n)[1]
    return LayerCourse(
        label=model.estimator,
        texture=model.texture,
        force_n=force_n,
        simulated=model.simulated,
        unit=model.unit,
        speeds_mm_s=model.speeds_mm_s,
        frequency_hz=model.frequencies_hz[:, force],
        amplitude=layer_amplitudes_g(model, criterion="energy")[:, force],
    )


@dataclass(frozen=True, eq=False)
class SpectrumPanel:
    """The smoothed spectrum of one condition and the layers found in it alone.

    Parameters
    ----------
    title : str
        Texture and condition.
    unit : str
        g, or arbitrary.
    simulated : bool
    frequency_hz, magnitude : (n,) ndarray
        Smoothed magnitude (σ = 30 Hz) in `unit` per unit noise.
    layer_frequency_hz, layer_height : (m,) ndarray
        Where the layers are, and the smoothed spectrum's height there.
    """

    title: str
    unit: str
    simulated: bool
    frequency_hz: Floats
    magnitude: Floats
    layer_frequency_hz: Floats
    layer_height: Floats


def spectrum_panels(
    recordings: RecordingSet, *, estimator: str = "paper-consistent"
) -> tuple[SpectrumPanel, ...]:
    """Find the layers of every condition on its own; no grid is needed.

    Parameters
    ----------
    recordings : RecordingSet
        Any textures and conditions with contact.
    estimator : str
        As in `modeling.fit_texture`.
    """
    panels = []
    for texture in recordings.textures:
        chosen = recordings.of_texture(texture)
        for (speed_mm_s, force_n), measured in sorted(condition_spectra(chosen).items()):
            found = find_layers(measured, estimator=estimator).frequencies_hz
            magnitude = measured.smoothed(SMOOTHING_HZ)
            panels.append(
                SpectrumPanel(
                    title=f"{texture}, {speed_mm_s:g} mm/s, {force_n:g} N",
                    unit=chosen.recordings[0].unit,
                    simulated=any(r.simulated for r in chosen.recordings),
                    frequency_hz=measured.frequency_hz,
                    magnitude=magnitude,
                    layer_frequency_hz=found,
                    layer_height=np.interp(found, measured.frequency_hz, magnitude),
                )
            )
    return tuple(panels)
