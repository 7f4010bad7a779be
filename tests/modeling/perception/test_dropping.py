"""Sets of layers that may go: layers that cancel, many layers, and what holds for all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import Simplification, TextureModel, Threshold, simplify
from tactileq.modeling.arrays import Floats
from tactileq.modeling.perception.dropping import MOST_GROUPS, Recorded
from tactileq.modeling.perception.power_changes import PowerChanges
from tactileq.modeling.perception.signs_of_rest import at_conditions
from tactileq.modeling.perception.simplification import distances_db

ModelMaker = Callable[..., TextureModel]
EVERYWHERE = np.array([1e-6, 1e6])
RATE_HZ = 5000.0


def flat(level_g: float) -> Threshold:
    return Threshold("flat", EVERYWHERE, np.full(2, level_g), "planted", "none")


def verdicts(found: Simplification) -> str:
    """k for kept, d for dropped."""
    return "".join(layer.verdict[0] for layer in found.layers)


def amplitude_g(gain: float, bandwidth_hz: float) -> float:
    """Of a lone layer: the sinusoid of equal power."""
    k = np.tan(np.pi * bandwidth_hz / RATE_HZ)
    return float(gain * np.sqrt(2 * k / (1 + k)))


def change_db(full: TextureModel, fewer: TextureModel, threshold: Threshold) -> Floats:
    """What is rendered without some layers against the full model, (C,), by a plain sum."""
    step_hz = 0.25
    frequency = np.arange(0.0, full.rate_hz / 2, step_hz) + step_hz / 2
    weight = 2 * (2 / full.rate_hz) * step_hz / threshold.held(frequency) ** 2
    at = [(v, f) for v in full.speeds_mm_s for f in full.forces_n]
    changes = [
        np.abs(full.peq(*c).response(frequency) ** 2 - fewer.peq(*c).response(frequency) ** 2)
        for c in at
    ]
    with np.errstate(divide="ignore"):
        found: Floats = 10 * np.log10(np.array([np.nansum(x * weight) for x in changes]))
    return found


# --- Layers that cancel each other

PAIR = [(200.0, 60.0, 1.0), (200.0, 60.0, -0.9)]
FAR = (900.0, 60.0, 1.0)


def test_two_layers_of_one_shape_that_cancel_go_together(make_model: ModelMaker) -> None:
    """Each is 10 dB above the threshold; what is left of them is 10 dB below it."""
    threshold = flat(amplitude_g(1.0, 60.0) / np.sqrt(10))
    model = make_model(0.0, [*PAIR, FAR])
    alone = distances_db(model, threshold)[0, 0]
    assert (alone[:2] > 9).all()
    found = simplify(model, threshold)
    assert verdicts(found) == "ddk"
    assert [layer.fills for layer in found.layers] == [0, 1, 0]
    assert found.layers[0].reason.startswith("dropping it with layer 2 changes the power by ")
    assert found.layers[1].reason.startswith("dropping it with layer 1 changes the power by ")
    assert max(change_db(model, found.model, threshold)) < 0


def test_what_is_left_of_two_layers_that_cancel_may_be_felt(make_model: ModelMaker) -> None:
    """With what they add to the skirts of the third one just above the threshold."""
    threshold = flat(amplitude_g(0.1, 60.0) * 10 ** (-0.1 / 20))
    found = simplify(make_model(0.0, [*PAIR, FAR]), threshold)
    assert verdicts(found) == "kkk"
    assert found.layers[0].reason == (
        "dropping it with layer 2 changes the power by more than the threshold in 4 of 4 conditions"
    )


# Under a loud layer of the same place, to whose shape they add less than half.
LOUD, HIDDEN = (200.0, 60.0, 1.0), [(200.0, 60.0, 0.3), (200.0, 60.0, -0.27)]
BETWEEN_G = amplitude_g(1.0, 60.0) * np.sqrt(0.2)


def test_two_layers_that_cancel_go_together_where_neither_may_go_alone(
    make_model: ModelMaker,
) -> None:
    """1.03² without both is 1², a change of 0.06; without one of them 1.27² or 1.3²."""
    model = make_model(0.0, [LOUD, *HIDDEN])
    found = simplify(model, flat(BETWEEN_G))
    assert [layer.fills for layer in found.layers] == [0, 0, 0]
    alone = distances_db(model, flat(BETWEEN_G))[0, 0, 1:]
    without = 10 * np.log10((np.array([1.27, 1.3]) ** 2 - 1.03**2) / 0.2)
    assert alone == pytest.approx(without, abs=1e-3)
    assert (without > 4).all()
    assert verdicts(found) == "kdd"
    together = 10 * np.log10((1.03**2 - 1) / 0.2)
    assert [layer.distance_db for layer in found.layers[1:]] == pytest.approx(
        [together] * 2, abs=1e-3
    )
    assert found.layers[1].reason == (
        "dropping it with layer 3 changes the power by 5.1 dB less than the threshold in every "
        "condition"
    )
    assert max(change_db(model, found.model, flat(BETWEEN_G))) < 0


def test_one_of_two_layers_that_cancel_is_kept_with_the_other(make_model: ModelMaker) -> None:
    """What is left of them is felt, too."""
    found = simplify(make_model(0.0, [LOUD, *HIDDEN]), flat(0.2 * BETWEEN_G))
    assert verdicts(found) == "kkk"


def test_a_layer_below_the_threshold_that_lifts_another_one_stays(make_model: ModelMaker) -> None:
    """Alone 1 dB below the threshold; on a layer of the same place, 20 dB louder, 12 dB above."""
    threshold = flat(amplitude_g(0.1, 60.0) * 10 ** (1 / 20))
    quiet = (200.0, 60.0, 0.1)
    alone = simplify(make_model(0.0, [quiet, (900.0, 60.0, 0.0)]), threshold).layers[0]
    assert alone.distance_db == pytest.approx(-1, abs=1e-3)
    lifted = simplify(make_model(0.0, [quiet, (200.0, 60.0, 1.0)]), threshold).layers[0]
    assert lifted.distance_db == pytest.approx(10 * np.log10((1.1**2 - 1) / 0.1**2) - 1, abs=1e-3)
    assert lifted.verdict == "kept"


def test_a_layer_that_adds_nothing_to_the_noise_goes(make_model: ModelMaker) -> None:
    """A loud layer that is an all-pass with the noise: G = −2·G_w."""
    model = make_model(0.3, [(200.0, 60.0, -0.6), (200.0, 60.0, 1e-9)])
    found = simplify(model, flat(0.01))
    assert found.layers[0].distance_db < -20


# --- Many layers


def many(
    make_model: ModelMaker, levels_db: list[float], *, level_sd_db: float = 0.0
) -> TextureModel:
    """Layers of 4 Hz, 100 Hz apart, so far from a threshold of 0.1 g."""
    unit = amplitude_g(1.0, 4.0)
    layers = [
        (100.0 * (n + 1), 4.0, (-1.0) ** n * 0.1 * 10 ** (db / 20) / unit)
        for n, db in enumerate(levels_db)
    ]
    return make_model(0.0, layers, level_sd_db=level_sd_db)


def test_of_more_than_six_layers_those_that_change_least_go(make_model: ModelMaker) -> None:
    levels = [6.0, -70.0, 7.0, -72.0, 8.0, -74.0, 9.0, -76.0]
    assert len(levels) > MOST_GROUPS
    assert verdicts(simplify(many(make_model, levels), flat(0.1))) == "kdkdkdkd"


def test_of_more_than_six_that_may_go_as_many_go_as_stay_below_together(
    make_model: ModelMaker,
) -> None:
    """Seven of −15 dB make −6.5 dB, with what they add to each other's skirts still below 0."""
    model = many(make_model, [0.5, *([-15.0] * 7)])
    found = simplify(model, flat(0.1))
    assert verdicts(found) == "k" + "d" * 7
    assert max(change_db(model, found.model, flat(0.1))) < 0
    louder = simplify(many(make_model, [0.5, *([-5.0] * 7)]), flat(0.1))
    assert 1 <= verdicts(louder).count("d") < 7
    assert any("not together" in layer.reason for layer in louder.layers)


def test_two_that_cancel_go_from_among_many(make_model: ModelMaker) -> None:
    """All the others are felt."""
    base = many(make_model, [10.0] * 7)
    wide = make_model(0.0, [(250.0, 40.0, 0.3), (250.0, 40.0, 0.09), (250.0, 40.0, -0.09)])
    model = replace(
        base,
        **{
            name: np.concatenate([getattr(base, name), getattr(wide, name)], axis=2)
            for name in (
                *("frequencies_hz", "bandwidths_hz", "gains", "level_sd_db"),
                *("inherited", "unresolved"),
            )
        },
    )
    found = simplify(model, flat(0.01))
    assert found.layers[-1].fills == found.layers[-2].fills == 0
    assert verdicts(found) == "k" * 8 + "dd"
    assert (distances_db(model, flat(0.01))[0, 0] > 0).all()


# --- Certainty


def test_the_deviation_of_several_is_the_mean_by_power(make_model: ModelMaker) -> None:
    """Gains 2 and 1, of equal widths: 4/5 and 1/5."""
    at = at_conditions(make_model(0.0, [(200.0, 50.0, 2.0), (300.0, 50.0, -1.0)]))
    changes = PowerChanges(at, rate_hz=RATE_HZ, threshold=flat(1.0), hold_above=False)
    level_sd_db = np.tile([1.0, 3.0], (4, 1))
    recorded = Recorded(at, changes, level_sd_db, beyond=False)
    assert recorded.deviations_db((0, 1)) == pytest.approx(0.8 * 1 + 0.2 * 3)
    assert recorded.deviations_db((1,)) == pytest.approx(3.0)


def test_a_pair_that_cancels_is_certain_only_with_its_own_distance(make_model: ModelMaker) -> None:
    """5 dB below the threshold together: of a deviation of 1 dB certain, of 3 dB not."""
    for level_sd_db, expected in ((1.0, "kdd"), (3.0, "kkk")):
        model = make_model(0.0, [LOUD, *HIDDEN], level_sd_db=level_sd_db)
        assert verdicts(simplify(model, flat(BETWEEN_G))) == expected


# --- What holds for all


LAYER = st.tuples(st.floats(20, 1500), st.floats(3, 300), st.floats(-1, 1))
# Below the smallest normal number a power of two takes digits away.
WITH_ALL_DIGITS = LAYER.filter(lambda layer: layer[2] == 0 or abs(layer[2]) > 1e-200)


@settings(deadline=None, max_examples=80)
@given(
    layers=st.lists(LAYER, min_size=1, max_size=5),
    noise_gain=st.floats(0, 0.1),
    level_g=st.floats(1e-3, 1.0),
    margin_db=st.sampled_from([0.0, 3.0]),
    hold_above=st.booleans(),
    name=st.sampled_from(["flat", "codec", "pen-hold"]),
    slope=st.floats(-0.7, 0.7),
)
def test_whatever_goes_the_change_stays_below_the_threshold(
    make_model: ModelMaker,
    layers: list[tuple[float, float, float]],
    noise_gain: float,
    level_g: float,
    margin_db: float,
    hold_above: bool,
    name: str,
    slope: float,
) -> None:
    """In every condition, of what is rendered in the end; the noise and one layer stay."""
    threshold = flat(level_g) if name == "flat" else Threshold.shipped(name)
    model = make_model(noise_gain, layers)
    growth = np.array([1.0, 1.0 + slope])[:, None, None]
    model = replace(model, gains=model.gains * growth)
    found = simplify(model, threshold, margin_db=margin_db, hold_above=hold_above)
    assert (found.model.noise_gains == model.noise_gains).all()
    assert 1 <= found.model.n_layers == verdicts(found).count("k")
    assert found.identical == ("d" not in verdicts(found))
    if not found.identical:
        known = threshold if hold_above else _no_bound(threshold)
        assert max(change_db(model, found.model, known)) < -margin_db + 0.05


def _no_bound(threshold: Threshold) -> Threshold:
    """Above the table's end nothing is felt."""
    end = threshold.frequency_hz[-1] * (1 + 1e-9)
    if end >= 1e6:
        return threshold
    frequency = np.array([*threshold.frequency_hz, end])
    return Threshold("no bound", frequency, np.array([*threshold.acceleration_g, 1e6]), "", "")


@settings(deadline=None, max_examples=40)
@given(layers=st.lists(WITH_ALL_DIGITS, min_size=1, max_size=4), exponent=st.integers(-10, 10))
def test_scaling_model_and_threshold_changes_no_verdict(
    make_model: ModelMaker, layers: list[tuple[float, float, float]], exponent: int
) -> None:
    """By powers of two."""
    scale = 2.0**exponent
    model = make_model(0.01, layers)
    larger = replace(model, gains=scale * model.gains, noise_gains=scale * model.noise_gains)
    found, scaled = simplify(model, flat(0.1)), simplify(larger, flat(scale * 0.1))
    assert verdicts(found) == verdicts(scaled)
    distances = [[layer.distance_db for layer in each.layers] for each in (found, scaled)]
    assert distances[0] == pytest.approx(distances[1], abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(layers=st.lists(LAYER, min_size=1, max_size=4))
def test_whatever_may_go_alone_goes_or_something_else_does(
    make_model: ModelMaker, layers: list[tuple[float, float, float]]
) -> None:
    """Nothing is kept in vain: of one condition and two layers or more, if any may go one goes."""
    found = simplify(make_model(0.01, layers), flat(0.1))
    may_go = [layer.distance_db < 0 for layer in found.layers if layer.fills == 0]
    if any(may_go) and len(may_go) > 1:
        assert "d" in verdicts(found)
