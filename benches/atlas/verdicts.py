"""Verdicts of simplification in the atlas: distance to the threshold and record length.

Textures whose layers are known are recorded twice and modelled; the threshold lies so far from the
true change of power by dropping one layer, the others kept. Textures have one condition: over a
grid a layer has to be below in all of them. The rules: docs/method/perception.md#simplification.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from itertools import product

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from tactileq.analysis.textures.recovery import match_layers
from tactileq.benches.atlas.case import Axis, Case
from tactileq.modeling import TextureModel, Threshold, fit_texture
from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.perception.by_power import judge_of
from tactileq.modeling.perception.dropping import HIGHEST_FLIP_PROBABILITY
from tactileq.modeling.perception.simplification import distances_db
from tactileq.modeling.perception.thresholds import FREQUENCIES_HZ
from tactileq.modeling.seeds import generator
from tactileq.stimuli.planted.textures import record_texture

FAMILY = "simplification verdicts"
SEED = 19
TEXTURES = {False: 2, True: 8}  # a fit takes longer than everything else
RATE_HZ = 5000.0
SPEED_MM_S, FORCE_N = 200.0, 2.0
NOISE_GAIN = 0.01
PLACES_HZ, PLACE_FACTOR = (70.0, 190.0, 400.0, 800.0), 1.15
BANDWIDTHS_HZ, LEVELS_DB = (15.0, 50.0), (12.0, 24.0)
Rule = Callable[[TextureModel, int, Threshold], bool]
Pair = tuple[TextureModel, tuple[TextureModel, TextureModel]]


def planted(rng: np.random.Generator) -> TextureModel:
    """One condition of four layers: 15–50 Hz wide, 12–24 dB above the noise, signs drawn."""
    shape = (1, 1, len(PLACES_HZ))
    heights = 10 ** (rng.uniform(*LEVELS_DB, shape) / 20)
    return TextureModel(
        texture="planted",
        rate_hz=RATE_HZ,
        speeds_mm_s=np.array([SPEED_MM_S]),
        forces_n=np.array([FORCE_N]),
        noise_gains=np.array([[NOISE_GAIN]]),
        frequencies_hz=np.array(PLACES_HZ) * PLACE_FACTOR ** rng.uniform(-1, 1, shape),
        bandwidths_hz=BANDWIDTHS_HZ[0]
        * (BANDWIDTHS_HZ[1] / BANDWIDTHS_HZ[0]) ** rng.uniform(0, 1, shape),
        gains=rng.choice([-1.0, 1.0], shape) * NOISE_GAIN * heights,
        level_sd_db=np.zeros(shape),
        estimator="planted",
        simulated=True,
    )


@lru_cache(maxsize=4)
def recorded_twice(textures: int, duration_s: float) -> tuple[Pair, ...]:
    """Each texture's truth and its models from two recordings of this length."""
    pairs = []
    for number in range(textures):
        truth = planted(generator([SEED, number]))
        first, second = (
            fit_texture(record_texture(truth, duration_s=duration_s, seed=seed))
            for seed in (2 * number, 2 * number + 1)
        )
        pairs.append((truth, (first, second)))
    return tuple(pairs)


def partners(model: TextureModel, truth: TextureModel) -> Integers:
    """The model's layer for each planted one, −1 where it was not found."""
    return match_layers(
        truth.frequencies_hz[0, 0],
        truth.bandwidths_hz[0, 0],
        estimated_frequency_hz=model.frequencies_hz[0, 0],
    )


def dropped_by_all_rules(model: TextureModel, layer: int, threshold: Threshold) -> bool:
    """What `simplify` decides on the layer, were all others kept."""
    alone = judge_of(model, threshold, margin_db=0.0, hold_above=True)((layer,))
    return alone.below and alone.flip_probability < HIGHEST_FLIP_PROBABILITY


def dropped_by_level(model: TextureModel, layer: int, threshold: Threshold) -> bool:
    """The paper's rule alone: what is measured is below the threshold."""
    return judge_of(model, threshold, margin_db=0.0, hold_above=True)((layer,)).below


def threshold_at(truth: TextureModel, layer: int, distance_db: float) -> Threshold:
    """A flat threshold that the true change by dropping a layer exceeds by a margin."""
    unit = Threshold("flat", np.array(FREQUENCIES_HZ), np.ones(2), "the atlas", "flat")
    level_db = float(distances_db(truth, unit)[0, 0, layer]) - distance_db
    return replace(unit, acceleration_g=np.full(2, 10 ** (level_db / 20)))


def dropped(pairs: tuple[Pair, ...], distance_db: float, *, rule: Rule) -> tuple[Bools, Bools]:
    """Whether each layer would be dropped, and whether it was found, (textures, layers, 2)."""
    gone, found = np.zeros((2, len(pairs), len(PLACES_HZ), 2), dtype=np.bool_)
    for row, (truth, models) in enumerate(pairs):
        for column, model in enumerate(models):
            for layer, partner in enumerate(partners(model, truth).tolist()):
                if partner >= 0:
                    found[row, layer, column] = True
                    threshold = threshold_at(truth, layer, distance_db)
                    gone[row, layer, column] = rule(model, partner, threshold)
    return gone, found


def wrongly_dropped(distance_db: float, duration_s: float, *, full: bool, rule: Rule) -> float:
    """Share of layers dropped although above the threshold by this much."""
    return _share(*dropped(recorded_twice(TEXTURES[full], duration_s), distance_db, rule=rule))


def kept_in_vain(distance_db: float, duration_s: float, *, full: bool, rule: Rule) -> float:
    """Share of layers kept although below the threshold by this much."""
    gone, found = dropped(recorded_twice(TEXTURES[full], duration_s), -distance_db, rule=rule)
    return _share(~gone, found)


def contradicted(distance_db: float, duration_s: float, *, full: bool, rule: Rule) -> float:
    """Share of layers below that one recording drops and the other finds above the threshold."""
    pairs = recorded_twice(TEXTURES[full], duration_s)
    gone, found = dropped(pairs, -distance_db, rule=rule)
    below, _ = dropped(pairs, -distance_db, rule=dropped_by_level)
    both = np.broadcast_to(found.all(axis=2, keepdims=True), found.shape)
    return _share(gone & ~below[:, :, ::-1], both)


def _share(happened: Bools, counted: Bools) -> float:
    return float(happened[counted].mean()) if counted.any() else float("inf")


# Where theory predicts failure: levels with normal errors of the least deviation.


@lru_cache(maxsize=4)
def level_deviations_db(duration_s: float) -> Floats:
    """Cramér–Rao bounds of the changes by lone layers as they are drawn, floor and all unknown."""
    widths, levels = np.geomspace(*BANDWIDTHS_HZ, 5), np.linspace(*LEVELS_DB, 5)
    layers = product(widths, levels, (1.0, -1.0))
    return np.array([_deviation_db(w, db, duration_s, sign=sign) for w, db, sign in layers])


def _deviation_db(width_hz: float, level_db: float, duration_s: float, *, sign: float) -> float:
    """Of √|G² + 2·G·G_w|·√B, the amplitude of the change, in dB."""
    frequency = np.arange(1, round(RATE_HZ / 2 * duration_s)) / duration_s
    truth = np.array([np.mean(PLACES_HZ), width_hz, 10 ** (level_db / 20), 1.0])

    def log_power(nepers: Floats) -> Floats:
        centre, width, gain, noise = truth * np.exp(nepers)
        band = band_response(
            frequency,
            centres_hz=np.array([centre]),
            bandwidths_hz=np.array([width]),
            rate_hz=RATE_HZ,
        )[0]
        log: Floats = np.log(np.abs(noise + sign * gain * band) ** 2)
        return log

    step = 1e-4
    slopes = np.array([(log_power(d) - log_power(-d)) / (2 * step) for d in step * np.eye(4)])
    covariance = np.linalg.inv(slopes @ slopes.T)
    ratio = sign * truth[2] / truth[3]
    level = np.array([0.0, 0.5, (ratio + 1) / (ratio + 2), 1 / (ratio + 2)])
    return float(20 / np.log(10) * np.sqrt(level @ covariance @ level))


def _edge(share: Callable[[Floats], Floats], allowed: float, duration_s: float) -> float:
    """Distance (dB) at which a share, of z = distance/deviation, is what is allowed on average."""

    def surplus(log_distance: float) -> float:
        z = np.exp(log_distance) / level_deviations_db(duration_s)
        return float(share(z).mean()) - allowed

    return float(np.exp(brentq(surplus, np.log(0.05), np.log(50.0))))


def above_by_normal_errors(duration_s: float) -> float:
    """P(level below) = Φ(−z)."""
    return _edge(lambda z: ndtr(-z), WRONG, duration_s)


def below_by_normal_errors(duration_s: float) -> float:
    """P(level above) = Φ(−z)."""
    return _edge(lambda z: ndtr(-z), IN_VAIN, duration_s)


def below_by_all_rules(duration_s: float) -> float:
    """Kept where P(flip) is not below 5 %: Φ(1.645 − z)."""
    return _edge(lambda z: ndtr(-ndtri(HIGHEST_FLIP_PROBABILITY) - z), IN_VAIN, duration_s)


def contradicted_by_normal_errors(duration_s: float) -> float:
    """Once below and once above: Φ(z)·Φ(−z)."""
    return _edge(lambda z: ndtr(z) * ndtr(-z), WRONG, duration_s)


def never(duration_s: float) -> float:
    """P(flip) below 5 % leaves no room for as much."""
    return float("nan")


# Dropping a layer that can be felt changes the texture: P(flip) allows one in twenty; one in five
# would make simplified models unreliable.
WRONG, WRONG_AT_MOST = 0.05, 0.2
# A layer kept unnecessarily costs a filter and changes nothing that is felt, so limits are wider.
IN_VAIN, IN_VAIN_AT_MOST = 0.2, 0.5

ALL_RULES, BY_LEVEL = "all rules", "paper's rule"
RULES: dict[str, Rule] = {ALL_RULES: dropped_by_all_rules, BY_LEVEL: dropped_by_level}
LENGTHS = {"0.25 s": 0.25, "1 s": 1.0}
ABOVE = Axis(name="level above the threshold", unit="dB", mild=6.0, severe=0.1)
BELOW = Axis(name="level below the threshold", unit="dB", mild=8.0, severe=0.1)
NORMAL = "normal errors of the levels, Cramér–Rao bound"
BY_DESIGN = "P(flip) < 5 % rules it out"


def _case(method: str, axis: Axis, measure: Callable[..., float], words: str) -> Case:
    in_vain = measure is kept_in_vain
    return Case(
        family=FAMILY,
        method=method,
        ours=method == ALL_RULES,
        axis=axis,
        figure=words,
        unit="",
        holds=IN_VAIN if in_vain else WRONG,
        degrades=IN_VAIN_AT_MOST if in_vain else WRONG_AT_MOST,
        measure=partial(measure, rule=RULES[method]),
        across="record length",
        columns=LENGTHS,
        theory=THEORY[method, measure],
        source=BY_DESIGN if THEORY[method, measure] is never else NORMAL,
    )


THEORY: dict[tuple[str, Callable[..., float]], Callable[[float], float]] = {
    (ALL_RULES, wrongly_dropped): never,
    (BY_LEVEL, wrongly_dropped): above_by_normal_errors,
    (ALL_RULES, kept_in_vain): below_by_all_rules,
    (BY_LEVEL, kept_in_vain): below_by_normal_errors,
    (ALL_RULES, contradicted): never,
    (BY_LEVEL, contradicted): contradicted_by_normal_errors,
}
CASES: tuple[Case, ...] = tuple(
    _case(method, axis, measure, words)
    for axis, measure, words in (
        (ABOVE, wrongly_dropped, "layers dropped though above"),
        (BELOW, kept_in_vain, "layers kept though below"),
        (BELOW, contradicted, "dropped, but above in a second record"),
    )
    for method in RULES
)
