"""The `joint` estimator over a whole grid: common layers and signs, every condition refitted.

Peaks are found in each condition alone, named by the laws that they follow over the grid, and
fitted again to the coherent response, with one sign per layer for the whole texture (METHOD 3–5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from modeling.coherent import CoherentFit, as_layers, coherent_fit, neighbouring_patterns
from modeling.grid import Condition
from modeling.joint import COHERENT_BY
from modeling.layers import Layers
from modeling.likelihood import (
    Bins,
    Bools,
    Power,
    bins_near,
    centres_and_widths,
    signal_power,
)
from modeling.peaks import SILENCE, Peaks, find_peaks_jointly, power_sum_misfit
from modeling.peq import Floats, clamp_bands
from modeling.spectra import Spectrum
from modeling.tracks import CLEAR_EVIDENCE, LEAST_SUPPORT, Tracks, find_tracks, foretell, strayed

# Signs and number of layers are decided on conditions spread over the grid.
DECIDING_CONDITIONS = 6
ABSENT_GAIN = 0.1  # of the noise gain: where the fit of a layer without a peak starts


@dataclass(frozen=True, eq=False)
class GridFit:
    """Layers of every condition under common names, and which had no peak of their own there."""

    layers: dict[Condition, Layers]
    inherited: dict[Condition, Bools]


@dataclass(frozen=True, eq=False)
class _Start:
    """One condition under the texture's layer names, before the coherent fit."""

    power: Power
    peaks: Peaks
    absent: Bools
    bins: Bins
    alone_misfit: float

    def fitted(self, signs: Floats, *, move: bool, steps: int = 8) -> CoherentFit:
        return coherent_fit(
            self.peaks,
            self.power,
            signs,
            known=self.absent,
            move=move,
            bins=self.bins,
            steps=steps,
        )

    def at(self, frequencies_hz: Floats, bandwidths_hz: Floats, which: Bools) -> _Start:
        """The same, with other places for some layers."""
        peaks = replace(
            self.peaks,
            frequencies_hz=np.where(which, frequencies_hz, self.peaks.frequencies_hz),
            bandwidths_hz=np.where(which, bandwidths_hz, self.peaks.bandwidths_hz),
        )
        return replace(self, peaks=peaks)

    def only(self, kept: list[int]) -> _Start:
        return replace(self, peaks=self.peaks.only(kept), absent=self.absent[kept])


@dataclass(frozen=True, eq=False)
class _Decision:
    """What holds for the whole texture: which layers, their signs, and whether they may move."""

    kept: list[int]
    signs: Floats
    move: bool


def fit_grid_jointly(spectra: Mapping[Condition, Spectrum]) -> GridFit:
    """Layers of one texture over its grid, by their frequencies in the top corner.

    Parameters
    ----------
    spectra : mapping of (speed, force) to Spectrum
        One texture, at least one condition. A silent one gets the others' layers without gain.
    """
    # The deciding conditions are picked by their place in the grid, whatever order they come in.
    spectra = dict(sorted(spectra.items()))
    powers = {condition: signal_power(s) for condition, s in spectra.items()}
    found = {c: SILENCE if p is None else find_peaks_jointly(p) for c, p in powers.items()}
    tracks = find_tracks(found)
    starts = {
        c: _start(power, found[c], tracks, row)
        for row, (c, power) in enumerate(powers.items())
        if power is not None
    }
    decided = _decide(list(starts.values()), tracks.chosen.shape[1])
    starts = {c: start.only(decided.kept) for c, start in starts.items()}
    fits = {c: start.fitted(decided.signs, move=decided.move) for c, start in starts.items()}
    absent = tracks.chosen[:, decided.kept] < 0
    fits = _started_again(spectra, starts, fits, decided=decided, absent=absent)
    told = _told(spectra, fits, absent)
    layers = {
        c: as_layers(fits[c], starts[c].power, known=absent[row])
        if c in fits
        else _silent(told[0][row], told[1][row])
        for row, c in enumerate(spectra)
    }
    return GridFit(layers, dict(zip(spectra, absent, strict=True)))


def _started_again(
    spectra: Mapping[Condition, Spectrum],
    starts: Mapping[Condition, _Start],
    fits: Mapping[Condition, CoherentFit],
    *,
    decided: _Decision,
    absent: Bools,
) -> dict[Condition, CoherentFit]:
    """The fits, those begun anew whose layers are absent or have strayed from their law.

    They start where the other conditions foretell, as do all layers of a condition whose fit has
    failed; and of a strayed one that fit is taken unless it is clearly the worse.
    """
    frequency, _ = _told(spectra, fits, absent)
    off: Bools = strayed(np.log(np.array(list(spectra))), frequency, present=~absent)
    if decided.move:
        off = _with_failed(off, [_failed(c, starts, fits) for c in spectra], absent)
    told = _told(spectra, fits, absent | off)
    again = dict(fits)
    for row, condition in enumerate(spectra):
        if condition not in fits or not (absent[row] | off[row]).any():
            continue
        start = starts[condition].at(told[0][row], told[1][row], absent[row] | off[row])
        begun = start.fitted(decided.signs, move=decided.move)
        if absent[row].any() or begun.misfit < fits[condition].misfit + COHERENT_BY:
            again[condition] = begun
    return again


def _failed(
    condition: Condition, starts: Mapping[Condition, _Start], fits: Mapping[Condition, CoherentFit]
) -> bool:
    """Whether the fit misses what the condition's own peaks explain."""
    if condition not in fits:
        return False
    return fits[condition].misfit > starts[condition].alone_misfit + CLEAR_EVIDENCE


def _with_failed(off: Bools, failed: list[bool], absent: Bools) -> Bools:
    """All layers of failed conditions, too, but those that no other condition could foretell."""
    whole = off | (np.array(failed)[:, None] & ~absent)
    told = (~absent & ~whole).any(axis=0)
    every: Bools = np.where(told, whole, off)
    return every


def _start(power: Power, found: Peaks, tracks: Tracks, row: int) -> _Start:
    """The condition's peaks under the layers' names; absent ones start with hardly any gain."""
    chosen = tracks.chosen[row]
    absent = chosen < 0
    gains = np.full(chosen.size, ABSENT_GAIN * found.noise_gain)
    gains[~absent] = found.gains[chosen[~absent]]
    # A law may lead out of the band.
    frequencies, bandwidths, _ = clamp_bands(
        tracks.frequencies_hz[row], tracks.bandwidths_hz[row], rate_hz=power.rate_hz
    )
    evidence = np.zeros(absent.size)
    evidence[~absent] = found.evidence[chosen[~absent]]
    peaks = Peaks(found.noise_gain, frequencies, bandwidths, gains, found.shape, evidence)
    bins = bins_near(power, frequencies, bandwidths)
    return _Start(power, peaks, absent, bins, power_sum_misfit(found, bins))


def _decide(starts: list[_Start], m: int) -> _Decision:
    """Signs and layers, on conditions spread over the grid.

    A layer that the coherent response of the others makes up for is dropped, and the signs of the
    rest are chosen again: what layers leave between and beyond each other looks like further ones
    to a sum of powers. If even the best response falls short of that sum, layers are independent
    of each other, and stay where it has them.
    """
    some = _spread(starts)
    best = _trial(some, list(range(m)), move=True)
    evidence = sum((start.peaks.evidence for start in some), np.zeros(m))
    for layer in np.argsort(evidence, kind="stable"):
        fewer = [i for i in best.kept if i != layer]
        if fewer and _may_do(some, fewer, best):
            best = _if_as_good(best, _trial(some, fewer, move=True))
    if not _holds(best, some):
        return _Decision(list(range(m)), _trial(some, list(range(m)), move=False).signs, move=False)
    return _Decision(best.kept, best.signs, move=True)


def _may_do(starts: list[_Start], kept: list[int], best: _Trial) -> bool:
    """Whether these layers alone, with any signs, come near the best fit in the clearest condition.

    A quick look, which spares most layers a trial without them.
    """
    clearest = max(range(len(starts)), key=lambda i: float(starts[i].peaks.evidence.sum()))
    start = starts[clearest].only(kept)
    limit = best.fits[clearest].misfit + CLEAR_EVIDENCE
    patterns = neighbouring_patterns(start.peaks.frequencies_hz)
    return any(start.fitted(signs, move=True, steps=5).misfit < limit for signs in patterns)


def _holds(trial: _Trial, starts: list[_Start]) -> bool:
    """Whether the coherent response fits as well as the sum of powers, in half of the conditions.

    In a few it may have missed the best fit.
    """
    excess = [f.misfit - s.alone_misfit for f, s in zip(trial.fits, starts, strict=True)]
    return not excess or float(np.median(excess)) <= COHERENT_BY


def _spread(starts: list[_Start]) -> list[_Start]:
    """A few conditions in all parts of the grid, given in the grid's order."""
    stride = max(1, round(0.382 * len(starts)))
    while np.gcd(stride, max(1, len(starts))) > 1:
        stride += 1
    count = min(DECIDING_CONDITIONS, len(starts))
    return [starts[i * stride % len(starts)] for i in range(count)]


@dataclass(frozen=True, eq=False)
class _Trial:
    """Some layers with the signs that suit them best, fitted in some conditions."""

    kept: list[int]
    signs: Floats
    fits: list[CoherentFit]


def _trial(starts: list[_Start], kept: list[int], *, move: bool) -> _Trial:
    """These layers with the signs that fit best.

    Tried are the patterns of METHOD 3 and each of them with one relation between neighbours turned
    (the layers above it change their signs): all on the three clearest conditions, the best
    three of them on the rest.
    """
    here = [start.only(kept) for start in starts]
    if not (here and kept):
        return _Trial(kept, np.ones(len(kept)), [s.fitted(np.ones(0), move=move) for s in here])
    centres = np.median([start.peaks.frequencies_hz for start in here], axis=0)
    candidates = neighbouring_patterns(centres)
    clearest = sorted(here, key=lambda start: -float(start.peaks.evidence.sum()))[:3]

    def fitted(signs: Floats, where: list[_Start]) -> list[CoherentFit]:
        return [start.fitted(signs, move=move) for start in where]

    first = [_all_but_the_worst(fitted(signs, clearest)) for signs in candidates]
    best = [candidates[i] for i in np.argsort(first, kind="stable")[:3]]
    fits = [fitted(signs, here) for signs in best]
    chosen = int(np.argmin([_all_but_the_worst(some) for some in fits]))
    return _Trial(kept, best[chosen], fits[chosen])


def _all_but_the_worst(fits: list[CoherentFit]) -> float:
    """Summed misfit, of three or more without the largest: that fit may have gone astray."""
    misfits = [f.misfit for f in fits]
    return sum(misfits) - (max(misfits) if len(misfits) > 2 else 0.0)


def _if_as_good(best: _Trial, fewer: _Trial) -> _Trial:
    """The trial with fewer layers, if hardly any condition is the worse for it."""
    losses = [b.misfit - a.misfit for a, b in zip(best.fits, fewer.fits, strict=True)]
    return fewer if _support(losses) < LEAST_SUPPORT * len(losses) else best


def _support(losses: list[float]) -> float:
    """Conditions that clearly need a layer, doubtful ones in part; no single one decides."""
    clear = np.sort(np.minimum(np.array(losses) / CLEAR_EVIDENCE, 1.0))
    return float(clear[:-1].sum() if clear.size > 3 else clear.sum())


def _told(
    spectra: Mapping[Condition, Spectrum], fits: Mapping[Condition, CoherentFit], absent: Bools
) -> tuple[Floats, Floats]:
    """Fitted frequencies and bandwidths (C, m); those of absent layers told from the others."""
    frequency, bandwidth = np.ones(absent.shape), np.ones(absent.shape)
    for row, condition in enumerate(spectra):
        if condition in fits:
            frequency[row], bandwidth[row] = centres_and_widths(
                fits[condition].theta, absent.shape[1]
            )
    told = foretell(np.log(np.array(list(spectra))), frequency, bandwidth, present=~absent)
    rate_hz = next(iter(spectra.values())).rate_hz
    return clamp_bands(*told, rate_hz=rate_hz)[:2]


def _silent(frequencies_hz: Floats, bandwidths_hz: Floats) -> Layers:
    none = np.zeros(frequencies_hz.size)
    return Layers(0.0, frequencies_hz, bandwidths_hz, none, none, np.ones(none.size, dtype=bool))
