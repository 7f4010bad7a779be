"""Peak finding in the atlas: how the estimators perform on difficult spectra.

The planted layers are ones that a user would expect to be found. Each difficulty is a function that
makes recordings of them, each figure compares planted with found layers; both use the same draws
of layers and noise along the whole axis, so that edges are clean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.special import erfinv

from tactileq.analysis.textures.recovery import match_layers
from tactileq.benches.atlas.case import Axis, Case
from tactileq.modeling import PEQ, Layers, Recording, RecordingSet, find_layers
from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.equalizer.bands import band_response, band_rms
from tactileq.modeling.estimation.paper import BANDWIDTH_PER_S
from tactileq.modeling.estimation.peaks import PENALTY
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.recordings.spectrum import SMOOTHING_HZ
from tactileq.modeling.seeds import generator
from tactileq.stimuli.planted.spectra import RATE_HZ, RandomTruth, TruthKind

FAMILY = "peak finding"
SEED = 13
DRAWS = {False: 2, True: 6}
TWO_SPEED_DRAWS = {False: 1, True: 3}  # of two recordings each
# Three layers far from each other, drawn within these ranges, their widths within a quarter.
RANGES_HZ = ((85.0, 125.0), (300.0, 500.0), (750.0, 1100.0))
WIDTHS_HZ = (20.0, 35.0, 60.0)
WIDTH_FACTOR = 1.25
NOISE_GAIN = 0.02
# The weakest layers of the planted textures stand a fifth of their height over their floor, and
# their nearest are 3.5 widths apart (stimuli/planted/textures.py).
USUAL_FLOOR, USUAL_SPACING = 0.2, 3.5
LEVELS_DB = (0.0, 6.0)  # of the layers above that
PAIRS_HZ, PAIR_RANGE = (320.0, 1100.0), 0.1
SPEEDS_MM_S = (100.0, 200.0)
HUM_HZ, HARMONIC_SHARE = 50.02, 0.25
ONE_SPEED = 1.0

Spoilt = tuple[RandomTruth, list[Recording]]
Trouble = Callable[[np.random.Generator, float, float], Spoilt]
Found = Sequence[tuple[RandomTruth, Layers]]


def measured(
    value: float,
    column: float,
    *,
    full: bool,
    estimator: str,
    trouble: Trouble,
    figure: Callable[[Found], float],
    draws: dict[bool, int] = DRAWS,
) -> float:
    """The figure for what an estimator finds in recordings with this difficulty."""
    found = []
    for draw in range(draws[full]):
        truth, recordings = trouble(generator([SEED, draw]), value, column)
        for _, spectrum in recording_spectra(RecordingSet(recordings)):
            found.append((truth, find_layers(spectrum, estimator=estimator)))
    return figure(found)


# What is planted, and what is done to it.


def planted(rng: np.random.Generator, *, floor: float = USUAL_FLOOR) -> RandomTruth:
    """Three layers, with a given floor relative to the weakest one (floor/height)."""
    frequency = np.array([rng.uniform(*span) for span in RANGES_HZ])
    widths = np.array(WIDTHS_HZ) * WIDTH_FACTOR ** rng.uniform(-1, 1, len(WIDTHS_HZ))
    heights = NOISE_GAIN / USUAL_FLOOR * 10 ** (rng.uniform(*LEVELS_DB, len(WIDTHS_HZ)) / 20)
    return _truth("coherent", floor / USUAL_FLOOR * NOISE_GAIN, frequency, widths, heights)


def _truth(
    kind: TruthKind, noise_gain: float, frequency_hz: Floats, bandwidth_hz: Floats, gains: Floats
) -> RandomTruth:
    places = {"frequencies_hz": frequency_hz, "bandwidths_hz": bandwidth_hz}
    return RandomTruth(PEQ(noise_gain=noise_gain, gains=gains, rate_hz=RATE_HZ, **places), kind)


def _recording(
    samples: Floats, *, speed_mm_s: float = SPEEDS_MM_S[0], rate_hz: float = RATE_HZ
) -> Recording:
    return Recording(samples, rate_hz, speed_mm_s, 1.0, "planted", simulated=True)


def noisy(rng: np.random.Generator, floor: float, column: float) -> Spoilt:
    """`floor`: noise gain over the height of the weakest layer that may be drawn."""
    truth = planted(rng, floor=floor)
    return truth, [_recording(truth.record(rng=rng))]


def short(rng: np.random.Generator, duration_s: float, column: float) -> Spoilt:
    """Records of this length."""
    truth = planted(rng)
    return truth, [_recording(truth.record(rng=rng, duration_s=duration_s))]


def crowded(rng: np.random.Generator, spacing: float, width_hz: float) -> Spoilt:
    """Two pairs of equal layers, a number of widths apart; powers add, without notch."""
    middles = np.array(PAIRS_HZ) * (1 + PAIR_RANGE * rng.uniform(-1, 1, len(PAIRS_HZ)))
    frequency = (middles[:, None] + spacing * width_hz * np.array([-0.5, 0.5])).ravel()
    widths = np.full(frequency.size, width_hz)
    heights = np.full(frequency.size, NOISE_GAIN / USUAL_FLOOR)
    truth = _truth("independent", NOISE_GAIN, frequency, widths, heights)
    return truth, [_recording(truth.record(rng=rng))]


def clipped(rng: np.random.Generator, overload: float, column: float) -> Spoilt:
    """`overload`: RMS of the vibration over the limit of the sensor."""
    truth = planted(rng)
    clean = truth.record(rng=rng)
    limit = clean.std() / overload
    return truth, [_recording(np.clip(clean, -limit, limit))]


def at_wrong_rate(rng: np.random.Generator, error_percent: float, column: float) -> Spoilt:
    """The declared sampling rate is this much above the true one."""
    truth = planted(rng)
    return truth, [_recording(truth.record(rng=rng), rate_hz=RATE_HZ * (1 + error_percent / 100))]


def with_hum(rng: np.random.Generator, ratio: float, speeds: float) -> Spoilt:
    """50 Hz and a quarter as much at 150 Hz; `ratio`: their RMS over that of the vibration."""
    truth = planted(rng)
    recordings = []
    for speed in SPEEDS_MM_S[: int(speeds)]:
        clean = truth.record(rng=rng)
        turns = 2 * np.pi * HUM_HZ * np.arange(clean.size) / RATE_HZ
        phases = rng.uniform(0, 2 * np.pi, 2)
        hum = np.sin(turns + phases[0]) + HARMONIC_SHARE * np.sin(3 * turns + phases[1])
        spoilt = clean + ratio * clean.std() / hum.std() * hum
        recordings.append(_recording(spoilt, speed_mm_s=speed))
    return truth, recordings


def fading(rng: np.random.Generator, factor: float, column: float) -> Spoilt:
    """Amplitude at the beginning of the record over that at its end; dB fall evenly."""
    truth = planted(rng)
    clean = truth.record(rng=rng)
    envelope = factor ** -np.linspace(-0.5, 0.5, clean.size)
    return truth, [_recording(clean * envelope / np.sqrt(np.mean(envelope**2)))]


def slowing(rng: np.random.Generator, drift_percent: float, column: float) -> Spoilt:
    """All frequencies fall by a share of their middle value, as on a slowing turntable."""
    truth, n = planted(rng), round(RATE_HZ)
    wide = truth.record(rng=rng, duration_s=1.5)
    share = np.arange(n) / n - 0.5
    at = 0.75 + share - drift_percent / 100 * (share**2 - 0.25) / 2
    return truth, [_recording(np.interp(at * RATE_HZ, np.arange(wide.size), wide))]


# Errors of the found layers.


def wrong_share(found: Found) -> float:
    """1 − F1: layers missed and spurious layers, over those planted and found."""
    matched = sum(int((_partners(truth, layers) >= 0).sum()) for truth, layers in found)
    both = sum(truth.layers.gains.size + layers.gains.size for truth, layers in found)
    return 1 - 2 * matched / both


def level_error_db(found: Found) -> float:
    """RMS error of the levels of the layers found; infinite where fewer than half are found.

    A level is that of a layer's own power, whatever its width and height are made of.
    """
    errors = []
    for truth, layers in found:
        partner = _partners(truth, layers)
        mine = np.flatnonzero(partner >= 0)
        estimated = layers.peq(rate_hz=RATE_HZ)
        errors.append(
            20 * np.log10(_levels_g(estimated)[partner[mine]] / _levels_g(truth.layers)[mine])
        )
    every = np.concatenate(errors)
    if 2 * every.size < sum(truth.layers.gains.size for truth, _ in found):
        return float("inf")
    return float(np.sqrt(np.mean(every**2)))


def frequency_error_percent(found: Found) -> float:
    """Median distance from a planted layer to the nearest one found, in percent."""
    errors = [
        np.abs(layers.frequencies_hz / frequency - 1).min() if layers.gains.size else np.inf
        for truth, layers in found
        for frequency in truth.layers.frequencies_hz
    ]
    return 100 * float(np.median(errors))


def not_separated(found: Found) -> float:
    """Share of pairs without a layer in reach of each of the two, half their distance to a side."""
    apart = []
    for truth, layers in found:
        for low, high in truth.layers.frequencies_hz.reshape(-1, 2):
            near = [np.abs(layers.frequencies_hz - f) < (high - low) / 2 for f in (low, high)]
            apart.append(all(each.any() for each in near))
    return 1 - float(np.mean(apart))


def _partners(truth: RandomTruth, found: Layers) -> Integers:
    return match_layers(
        truth.layers.frequencies_hz,
        truth.layers.bandwidths_hz,
        estimated_frequency_hz=found.frequencies_hz,
    )


def _levels_g(layers: PEQ) -> Floats:
    return band_rms(np.abs(layers.gains), layers.bandwidths_hz, rate_hz=RATE_HZ)


# Where theory predicts failure.


def evidence(expected: Floats, without: Floats) -> float:
    """Expected gain of log likelihood from the true power of each line instead of another."""
    ratio = expected / without
    return float(np.sum(ratio - 1 - np.log(ratio)))


def floor_of_no_evidence(column: float) -> float:
    """The floor (over the layer) at which a lone layer, 20 Hz wide, gains just the minimum."""
    band = _bands(np.array([np.mean(RANGES_HZ[0])]), WIDTHS_HZ[0])[0]

    def surplus(log_floor: float) -> float:
        power = np.abs(1 + band / np.exp(log_floor)) ** 2
        return evidence(power, np.ones(power.size)) - PENALTY

    return float(np.exp(brentq(surplus, np.log(1e-2), np.log(1e2))))


@lru_cache(maxsize=8)
def spacing_of_no_evidence(width_hz: float) -> float:
    """Widths at which two layers gain just the minimum over the best single layer."""

    def surplus(spacing: float) -> float:
        places = PAIRS_HZ[0] + spacing * width_hz * np.array([-0.5, 0.5])
        both = USUAL_FLOOR**2 + (np.abs(_bands(places, width_hz)) ** 2).sum(axis=0)

        def misfit(one: Floats) -> float:
            width, height = np.exp(one)
            band = np.abs(_bands(np.array([PAIRS_HZ[0]]), width)[0]) ** 2
            return evidence(both, USUAL_FLOOR**2 + height * band)

        start = np.log([width_hz * (1 + spacing), 1.0])
        return float(minimize(misfit, start, method="Nelder-Mead").fun) - PENALTY

    return float(brentq(surplus, 0.1, 6.0, rtol=1e-3))


def _bands(centres_hz: Floats, width_hz: float) -> NDArray[np.complex128]:
    """Responses (k, n) at the lines of a record of a second."""
    widths = np.full(centres_hz.size, width_hz)
    frequency = np.arange(1.0, RATE_HZ / 2)
    return band_response(frequency, centres_hz=centres_hz, bandwidths_hz=widths, rate_hz=RATE_HZ)


def length_of_one_db(column: float) -> float:
    """Where the Cramér–Rao bound of a level, 10/ln 10/√(πBT) dB, is 1 dB for the mean 1/B."""
    return float((10 / np.log(10) / LEVEL_DB) ** 2 / np.pi * np.mean(1 / np.array(WIDTHS_HZ)))


def spacing_of_merging(width_hz: float) -> float:
    """Widths at which two equal Gaussian peaks of the smoothed spectrum become one, 2σ."""
    return float(2 * np.hypot(SMOOTHING_HZ, width_hz / BANDWIDTH_PER_S) / width_hz)


def overload_of_one_db(column: float) -> float:
    """Where a limiter's gain for Gaussian vibration, erf(limit/(√2·RMS)), is −1 dB (Bussgang)."""
    return float(1 / (np.sqrt(2) * erfinv(10 ** (-LEVEL_DB / 20))))


def rate_error_allowed(column: float) -> float:
    """A wrong rate is a frequency error of the same size, exactly."""
    return FREQUENCY_PERCENT


# Each wrong layer must be named, compared with a threshold and rendered; one in ten can be checked
# individually, one in three makes the list useless.
WRONG, WRONG_AT_MOST = 0.1, 0.33
# People can tell vibrations apart that differ by about 1 dB or more; 3 dB are twice the power.
LEVEL_DB, LEVEL_DB_AT_MOST = 1.0, 3.0
# Of vibrations at the fingertip, frequencies that differ by less than about 5 to 10 % feel alike;
# 20 % is a sixth of an octave and more than any neighbour of a texture's layers moves by chance.
FREQUENCY_PERCENT, FREQUENCY_PERCENT_AT_MOST = 5.0, 20.0
# Two that are read as one: one pair in ten, one in two.
MERGED, MERGED_AT_MOST = 0.1, 0.5

FLOOR = Axis(name="noise floor over layer", unit="", mild=0.05, severe=3.0, default=USUAL_FLOOR)
LENGTH = Axis(name="record length", unit="s", mild=2.0, severe=0.05, default=1.0)
SPACING = Axis(
    name="spacing of two layers", unit="widths", mild=8.0, severe=0.5, default=USUAL_SPACING
)
# Crests of a vibration are about four times its RMS; a range set to that contains them.
OVERLOAD = Axis(name="RMS over the sensor's limit", unit="", mild=0.1, severe=3.0, default=0.25)
# Clocks of usual converters are within 0.01 %.
WRONG_RATE = Axis(name="error of the declared rate", unit="%", mild=0.01, severe=50.0, default=0.01)
# A sensor that is shielded and earthed.
HUM = Axis(name="hum over vibration (RMS)", unit="", mild=0.01, severe=30.0, default=0.01)
FADING = Axis(name="first over last amplitude", unit="", mild=1.0, severe=100.0, default=1.1)
SLOWING = Axis(name="fall of all frequencies", unit="%", mild=0.5, severe=60.0, default=2.0)

JOINT = "joint"
EITHER = "paper, either reading"  # both readings find the same peaks
READINGS = {JOINT: "joint", "paper": "paper", "paper-consistent": "paper-consistent"}
ESTIMATOR_OF = READINGS | {EITHER: "paper"}
ONE_RECORD = (
    "in a single record of one second, layers 15 Hz wide that are less than about four widths "
    "apart are read as one wider layer, because the choice of the number of layers is cautious; "
    "specify the number where it is known"
)
ASKED_FOR = "log likelihood that a layer of 20 Hz is expected to gain = that asked for (6)"


def _case(method: str, axis: Axis, trouble: Trouble, **rest: Any) -> Case:
    """By default the figure is the share of wrong layers."""
    figure: Callable[[Found], float] = rest.pop("scored_by", wrong_share)
    words, unit, holds, degrades = FIGURES[figure]
    return Case(
        family=FAMILY,
        method=method,
        ours=method == JOINT,
        axis=axis,
        figure=words,
        unit=unit,
        holds=holds,
        degrades=degrades,
        measure=partial(
            measured,
            estimator=ESTIMATOR_OF[method],
            trouble=trouble,
            figure=figure,
            draws=TWO_SPEED_DRAWS if trouble is with_hum else DRAWS,
        ),
        **rest,
    )


FIGURES: dict[Callable[[Found], float], tuple[str, str, float, float]] = {
    wrong_share: ("layers missed or invented (1 − F1)", "", WRONG, WRONG_AT_MOST),
    level_error_db: ("error of levels (RMS)", "dB", LEVEL_DB, LEVEL_DB_AT_MOST),
    frequency_error_percent: (
        "error of frequencies (median)",
        "%",
        FREQUENCY_PERCENT,
        FREQUENCY_PERCENT_AT_MOST,
    ),
    not_separated: ("pairs not told apart", "", MERGED, MERGED_AT_MOST),
}
WIDTH_COLUMNS = {"15 Hz wide": 15.0, "60 Hz wide": 60.0}
SPEED_COLUMNS = {"two speeds": 2.0, "one speed": ONE_SPEED}

CASES: tuple[Case, ...] = (
    _case(JOINT, FLOOR, noisy, theory=floor_of_no_evidence, source=ASKED_FOR),
    _case(EITHER, FLOOR, noisy),
    _case(JOINT, LENGTH, short),
    _case(EITHER, LENGTH, short),
    *(
        _case(
            method,
            LENGTH,
            short,
            scored_by=level_error_db,
            theory=length_of_one_db,
            source="Cramér–Rao bound of a level, 10/ln 10/√(πBT)",
        )
        for method in READINGS
    ),
    _case(
        JOINT,
        SPACING,
        crowded,
        scored_by=not_separated,
        across="width of the layers",
        columns=WIDTH_COLUMNS,
        theory=spacing_of_no_evidence,
        source="log likelihood that the second layer is expected to gain = that asked for (6)",
        exception=ONE_RECORD,
    ),
    _case(
        EITHER,
        SPACING,
        crowded,
        scored_by=not_separated,
        across="width of the layers",
        columns=WIDTH_COLUMNS,
        theory=spacing_of_merging,
        source="two equal Gaussian peaks merge at 2σ, smoothing included",
    ),
    *(
        _case(
            method,
            OVERLOAD,
            clipped,
            scored_by=level_error_db,
            theory=overload_of_one_db,
            source="gain of a limiter for Gaussian vibration (Bussgang)",
        )
        for method in READINGS
    ),
    *(
        _case(
            method,
            WRONG_RATE,
            at_wrong_rate,
            scored_by=frequency_error_percent,
            theory=rate_error_allowed,
            source="a wrong rate is a frequency error of the same size",
        )
        for method in (JOINT, EITHER)
    ),
    *(
        _case(method, HUM, with_hum, across="number of recorded speeds", columns=SPEED_COLUMNS)
        for method in (JOINT, EITHER)
    ),
    *(_case(method, FADING, fading) for method in (JOINT, EITHER)),
    *(_case(method, SLOWING, slowing) for method in (JOINT, EITHER)),
)
