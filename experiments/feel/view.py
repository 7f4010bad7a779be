"""What the window for visitors shows: spectra, layers against the threshold, hand, level.

Arrays and texts, no window: everything here can be computed and tested without a screen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Literal, NamedTuple

import numpy as np

from tactileq.experiments.feel.rigs import HandNow, OutputNow
from tactileq.experiments.feel.textures import Texture
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import counted
from tactileq.modeling.models.loading import Layered
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.by_power import changes_alone
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.perception.verdicts import CriterionName

LOWEST_HZ = 10.0
HIGHEST_SHARE = 0.98  # of the Nyquist frequency
POINTS = 256
# A narrow peak would fall between the points of a logarithmic axis: of each layer's width, these.
AROUND_A_PEAK = np.array([-2.0, -1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0])
DECADES = 3.0
TINY = 1e-30

Place = Literal["off", "rest", "below", "inside", "above"]


class FeltLayers(NamedTuple):
    """The m layers of a model under the hand.

    Parameters
    ----------
    frequency_hz, amplitude_g : (m,) ndarray
        The amplitude (peak) is by the criterion of `simplify`; by `energy` that of the sinusoid
        of the power that dropping the layer changes.
    sensation_db : (m,) ndarray
        Distance to the threshold; NaN where no threshold is known, −inf for a silent layer.
    felt : (m,) ndarray of bool
        At or above the threshold.
    unknown : (m,) ndarray of bool
        No threshold is known at these frequencies.
    """

    frequency_hz: Floats
    amplitude_g: Floats
    sensation_db: Floats
    felt: Bools
    unknown: Bools


class ModelNow(NamedTuple):
    """A model under the hand: its spectrum (n,) over n frequencies, in g/√Hz, and its layers."""

    frequency_hz: Floats
    density: Floats
    layers: FeltLayers
    rms_g: float


class Now(NamedTuple):
    """All that is shown of a texture under the hand; `simplified` is None where there is none."""

    full: ModelNow
    simplified: ModelNow | None
    place: Place


@dataclass(frozen=True, kw_only=True)
class FeltCriterion:
    """The criterion for whether a layer is felt, as in `tactileq.simplify`."""

    threshold: Threshold
    criterion: CriterionName = "energy"
    hold_above: bool = True

    def layers(self, peq: PEQ) -> FeltLayers:
        """Each layer of one condition against the threshold.

        By `energy` by the change of power if it alone is dropped here, signs chosen again for this
        condition. Above the end of the threshold's table what is below its last level is not felt
        (where `hold_above`), of what is louder nothing is known.
        """
        amplitude, level = self._by_power(peq) if self._by_energy else self._by_amplitude(peq)
        unknown = np.isnan(level)
        return FeltLayers(peq.frequencies_hz, amplitude, level, ~unknown & (level >= 0), unknown)

    @property
    def _by_energy(self) -> bool:
        return self.criterion == "energy"

    def _by_power(self, peq: PEQ) -> tuple[Floats, Floats]:
        changes = changes_alone(peq, self.threshold, hold_above=self.hold_above)
        amplitude = np.array([float(change.amplitude_g[0]) for change in changes])
        level = np.array([float(change.distances_db()[0][0]) for change in changes])
        return amplitude, level

    def _by_amplitude(self, peq: PEQ) -> tuple[Floats, Floats]:
        frequency = peq.frequencies_hz
        amplitude = layer_amplitudes_g(peq, criterion=self.criterion)
        held = (self.threshold.held if self.hold_above else self.threshold.at)(frequency)
        with np.errstate(divide="ignore", invalid="ignore"):
            level = 20 * np.log10(amplitude / held)
        unknown = np.isnan(self.threshold.at(frequency)) & ~(level < 0)
        return amplitude, np.where(unknown, np.nan, level)


def texture_now(texture: Texture, hand: HandNow, yardstick: FeltCriterion) -> Now:
    """Both models of a texture under the hand as it is now."""
    simplified = texture.simplified
    return Now(
        model_now(texture.full, hand, yardstick),
        None if simplified is None else model_now(simplified, hand, yardstick),
        place_of(hand, texture.full),
    )


def model_now(model: Layered, hand: HandNow, yardstick: FeltCriterion) -> ModelNow:
    """A model's spectrum, layers and level under the hand as it is now.

    A hand that is not there counts as lifted off, as it does for the rig.
    """
    speed, force = (hand.speed_mm_s, hand.force_n) if hand.there else (0.0, 0.0)
    peq = model.peq(speed, force)
    frequency = _frequencies(peq)
    density = peq.response(frequency) * float(np.sqrt(2 / peq.rate_hz))
    rms = float(np.sqrt(np.trapezoid(density**2, frequency)))
    return ModelNow(frequency, density, yardstick.layers(peq), rms)


def _frequencies(peq: PEQ) -> Floats:
    """(n,) rising frequencies on which no peak is missed; n is the same at every hand."""
    highest = HIGHEST_SHARE * peq.rate_hz / 2
    near = peq.frequencies_hz[:, None] + peq.bandwidths_hz[:, None] * AROUND_A_PEAK
    points = np.geomspace(LOWEST_HZ, highest, POINTS)
    return np.sort(np.concatenate([points, np.clip(near, LOWEST_HZ, highest).ravel()]))


def place_of(hand: HandNow, model: Layered) -> Place:
    """Where the hand is on the grid of a model.

    "off": lifted off or not there; "rest": touching without a motion; "below" and "above": outside
    the grid, where the level falls to 0 or the nearest condition is taken.
    """
    speed, force = abs(hand.speed_mm_s), hand.force_n
    if not (hand.there and force > 0 and np.isfinite(speed) and np.isfinite(force)):
        return "off"
    if speed == 0:
        return "rest"
    if speed > model.speeds_mm_s[-1] or force > model.forces_n[-1]:
        return "above"
    if speed < model.speeds_mm_s[0] or force < model.forces_n[0]:
        return "below"
    return "inside"


def spectrum_range(textures: Sequence[Texture]) -> tuple[float, float]:
    """Lowest and highest density (g/√Hz) on the axis of spectra, the same for all textures."""
    highest = max(_loudest(texture.full) for texture in textures)
    top = 10.0 ** np.ceil(np.log10(max(highest, TINY)) + 0.1)
    return float(top / 10**DECADES), float(top)


def _loudest(model: Layered) -> float:
    """The largest density (g/√Hz) of a model over its grid."""
    responses = (peq.response(_frequencies(peq)).max() for peq in _conditions(model))
    return float(max(responses) * np.sqrt(2 / model.rate_hz))


def _conditions(model: Layered) -> Iterator[PEQ]:
    """The equalizer of each condition of a model's grid."""
    return (model.peq(float(v), float(f)) for v in model.speeds_mm_s for f in model.forces_n)


def amplitude_range(yardstick: FeltCriterion, textures: Sequence[Texture]) -> tuple[float, float]:
    """Lowest and highest amplitude (g peak) on the axis of layers, the same for all textures."""
    threshold = yardstick.threshold
    highest = float(threshold.acceleration_g.max())
    for texture in textures:
        amplitudes = (yardstick.layers(peq).amplitude_g for peq in _conditions(texture.full))
        highest = max(highest, *(float(amplitude.max(initial=0)) for amplitude in amplitudes))
    top = 10.0 ** np.ceil(np.log10(2 * highest))
    bottom = 10.0 ** np.floor(np.log10(float(threshold.acceleration_g.min()) / 3))
    return float(bottom), float(top)


# --- Words -----------------------------------------------------------------------------------

PLACE_WORDS: dict[Place, str] = {
    "off": "lifted off: silence",
    "rest": "at rest: silence",
    "below": "outside the grid: fades out",
    "inside": "on the recorded grid",
    "above": "outside the grid: held at its edge",
}


def short(name: str, longest: int) -> str:
    """A name in at most this many characters."""
    return name if len(name) <= longest else f"{name[: longest - 1]}…"


def felt_words(layers: FeltLayers) -> str:
    """How many layers are felt, in words."""
    count, felt, unknown = layers.felt.size, int(layers.felt.sum()), int(layers.unknown.sum())
    words = f"{felt} of {counted(count, 'layer')}"
    return f"{words}, {unknown} unknown" if unknown else words


def level_words(sensation_db: float) -> str:
    """A sensation level beside its layer."""
    if np.isnan(sensation_db):
        return "?"
    return f"{sensation_db:+.0f} dB" if sensation_db > -99 else "silent"


def hand_words(hand: HandNow) -> str:
    """Speed and force, and which of them nobody measures."""
    if not hand.there:
        return "no hand"
    assumed = " (assumed)" if hand.force_assumed else ""
    wall = "" if isnan(hand.depth_mm) else f"   {max(hand.depth_mm, 0.0):.1f} mm deep"
    return f"{abs(hand.speed_mm_s):.0f} mm/s   {hand.force_n:.1f} N{assumed}{wall}"


def output_words(output: OutputNow | None, now: ModelNow, *, playing: bool) -> tuple[str, ...]:
    """Level, limits, misses and latency, a line each.

    Without an output the level is what the hand would feel.
    """
    if output is None:
        level = now.rms_g if playing else 0.0
        return (f"level: would be {level:.3f} g RMS", "no sound device: nothing is played")
    latency = (
        "unknown" if np.isnan(output.latency_s) else f"{1000 * output.latency_s:.0f} ms, as stated"
    )
    return (
        f"level: {output.rms_g:.3f} g RMS, {output.peak_g:.2f} g peak",
        f"limits touched: {', '.join(output.limits) or 'none'}",
        f"late blocks: {output.misses}",
        f"latency of the output: {latency}",
    )
