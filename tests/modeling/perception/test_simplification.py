"""Which layers go: docs/method/perception.md#criteria and #simplification."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from tactileq.modeling import (
    CRITERIA,
    InputError,
    Simplification,
    TextureModel,
    Threshold,
    simplify,
)
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.perception.simplification import distances_db
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
# 0.1 g from 10 to 1000 Hz: with `paper-gain` a layer's gain is its level.
FLAT = Threshold("flat", np.array([10.0, 1000.0]), np.array([0.1, 0.1]), "planted", "none")


def at_db(*levels_db: float) -> list[tuple[float, float, float]]:
    """Layers that lie this far from FLAT under `paper-gain`."""
    return [(100.0 * (n + 1), 50.0, 0.1 * 10 ** (db / 20)) for n, db in enumerate(levels_db)]


def run(model: TextureModel, **options: object) -> Simplification:
    return simplify(model, FLAT, **{"criterion": "paper-gain", **options})  # type: ignore[arg-type]


def verdicts(simplification: Simplification) -> list[str]:
    return [layer.verdict for layer in simplification.layers]


# --- criteria


def test_criteria_at_50_hz_and_1_s(make_model: ModelMaker) -> None:
    """`paper-fft` 20 dB below `energy`, `paper-gain` 12 dB above, 32 dB apart."""
    model = make_model(0.0, [(200.0, 50.0, 0.3)])
    level = {
        name: 20 * np.log10(layer_amplitudes_g(model, criterion=name)[0, 0, 0]) for name in CRITERIA
    }
    assert level["paper-fft"] - level["energy"] == pytest.approx(-19.87, abs=0.05)
    assert level["paper-gain"] - level["energy"] == pytest.approx(12.15, abs=0.05)
    assert level["paper-gain"] - level["paper-fft"] == pytest.approx(32.0, abs=0.05)


@settings(deadline=None)
@given(st.floats(2, 2000), st.floats(0.2, 2000), st.floats(-10, 10))
def test_amplitudes_are_the_formulas(frequency: float, bandwidth: float, gain: float) -> None:
    model = TextureModel(
        texture="x",
        rate_hz=5000.0,
        speeds_mm_s=[1, 2],
        forces_n=[1, 2],
        noise_gains=np.zeros((2, 2)),
        frequencies_hz=np.full((2, 2, 1), frequency),
        bandwidths_hz=np.full((2, 2, 1), bandwidth),
        gains=np.full((2, 2, 1), gain),
        level_sd_db=np.zeros((2, 2, 1)),
        estimator="planted",
    )
    k = np.tan(np.pi * bandwidth / 5000)
    expected = {
        "energy": np.sqrt(2 * k / (1 + k)) * abs(gain),
        "paper-fft": abs(gain) * np.sqrt(np.pi / 5000),
        "paper-gain": abs(gain),
    }
    for name in CRITERIA:
        amplitude = layer_amplitudes_g(model, criterion=name)
        assert amplitude == pytest.approx(np.full((2, 2, 1), expected[name]), rel=1e-12)


def test_energy_and_fft_are_what_a_record_shows(make_model: ModelMaker) -> None:
    """The mean |FFT|·2/N at the peak, and √2 × the RMS, of simulated noise through the layer."""
    rng = np.random.default_rng(0)
    model = make_model(0.0, [(200.0, 50.0, 0.3)])
    response = model.peq(200.0, 2.0).complex_response(np.arange(2501.0))
    spectra = [response * np.fft.rfft(rng.standard_normal(5000)) for _ in range(400)]
    single_sided = np.mean([2 * np.abs(x[195:206]) / 5000 for x in spectra])
    rms = np.sqrt(np.mean([2 * np.sum(np.abs(x) ** 2) / 5000**2 for x in spectra]))
    amplitude = {n: layer_amplitudes_g(model, criterion=n)[0, 0, 0] for n in CRITERIA}
    assert single_sided == pytest.approx(amplitude["paper-fft"], rel=0.04)
    assert np.sqrt(2) * rms == pytest.approx(amplitude["energy"], rel=0.02)


def test_distance_is_relative_to_the_threshold_at_the_layers_frequency(
    make_model: ModelMaker,
) -> None:
    slope = Threshold("slope", np.array([10.0, 1000.0]), np.array([1e-3, 1e-1]), "", "")
    model = make_model(0.0, [(100.0, 50.0, 0.1), (2000.0, 50.0, 0.1)])
    distance = distances_db(model, slope, criterion="paper-gain")
    assert distance[:, :, 0] == pytest.approx(20.0)  # threshold 0.01 g there
    assert np.isnan(distance[:, :, 1]).all()


# --- rules


def test_layers_below_in_every_condition_go(make_model: ModelMaker) -> None:
    model = make_model(0.07, at_db(6, -20, 0.5, -30))
    result = run(model)
    assert verdicts(result) == ["kept", "dropped", "kept", "dropped"]
    assert [layer.layer for layer in result.layers] == [1, 2, 3, 4]
    assert [layer.distance_db for layer in result.layers] == pytest.approx([6, -20, 0.5, -30])
    kept = model.with_layers([0, 2])
    assert result.model == replace(kept, simplified_from=model.sha256)
    assert (result.model.noise_gains == 0.07).all()
    assert result.layers[1].reason == "below threshold in every condition"


def test_a_dropped_layer_whose_level_is_a_bound_says_so(make_model: ModelMaker) -> None:
    model = make_model(0.0, at_db(6, -6))
    unresolved = np.zeros(model.gains.shape, dtype=bool)
    unresolved[0, :, 1] = True
    result = run(TextureModel(**{**fields_of(model), "unresolved": unresolved}))
    count, conditions = unresolved.sum(), model.noise_gains.size
    assert result.layers[1].reason == (
        f"below threshold in every condition (not resolved in {count} of {conditions})"
    )


@pytest.mark.parametrize("condition", [(0, 0), (1, 0), (2, 1)])
def test_layer_above_in_one_condition_is_kept(
    make_model: ModelMaker, condition: tuple[int, int]
) -> None:
    model = make_model(0.0, at_db(10, -20), speeds_mm_s=(50.0, 100.0, 200.0))
    gains = model.gains.copy()
    gains[(*condition, 1)] = -0.1 * 10 ** (1 / 20)
    changed = TextureModel(**{**fields_of(model), "gains": gains})
    layer = run(changed).layers[1]
    assert layer.verdict == "kept"
    assert layer.reason == "above threshold in 1 of 6 conditions"
    assert layer.distance_db == pytest.approx(1.0)
    assert layer.worst_speed_mm_s == model.speeds_mm_s[condition[0]]
    assert layer.worst_force_n == model.forces_n[condition[1]]
    assert layer.worst_frequency_hz == 200.0


def fields_of(model: TextureModel) -> dict[str, object]:
    return {name: getattr(model, name) for name in model.__dataclass_fields__}


def test_dropped_layers_stay_below_in_sum(make_model: ModelMaker) -> None:
    """Three layers at −1 dB sum to +3.8 dB: two come back, the loudest first."""
    assert 10 * np.log10(3 * 10**-0.1) == pytest.approx(3.77, abs=0.01)
    result = run(make_model(0.0, at_db(10, -1.0, -1.2, -1.1)))
    assert verdicts(result) == ["kept", "kept", "dropped", "kept"]
    assert "not together" in result.layers[1].reason
    # −3.1 dB twice is −0.1 dB: both may go. −2.9 dB twice is +0.1 dB: one stays.
    assert verdicts(run(make_model(0.0, at_db(10, -3.1, -3.1)))) == ["kept", "dropped", "dropped"]
    assert verdicts(run(make_model(0.0, at_db(10, -2.9, -2.9)))).count("dropped") == 1


def flat_model(levels_db: list[float], level_sd_db: float) -> TextureModel:
    """Layers at 100 Hz that lie this far from FLAT under `paper-gain`, on a 2 × 2 grid."""
    shape = (2, 2, len(levels_db))
    return TextureModel(
        texture="x",
        rate_hz=5000.0,
        speeds_mm_s=[1, 2],
        forces_n=[1, 2],
        noise_gains=np.zeros((2, 2)),
        frequencies_hz=np.full(shape, 100.0),
        bandwidths_hz=np.full(shape, 50.0),
        gains=np.broadcast_to(0.1 * 10 ** (np.array(levels_db) / 20), shape),
        level_sd_db=np.full(shape, level_sd_db),
        estimator="planted",
    )


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-30, 3), min_size=1, max_size=9))
def test_whatever_is_dropped_is_below_alone_and_in_sum(levels_db: list[float]) -> None:
    result = run(flat_model(levels_db, 0.0))
    dropped = [db for db, v in zip(levels_db, verdicts(result), strict=True) if v == "dropped"]
    assert all(db < 1e-9 for db in dropped)
    assert sum(10 ** (db / 10) for db in dropped) < 1 + 1e-9
    assert result.model.n_layers == len(levels_db) - len(dropped) >= 1


def test_a_layer_of_unknown_threshold_takes_no_part_in_the_sum(make_model: ModelMaker) -> None:
    outside = (1500.0, 50.0, 100.0)
    result = run(make_model(0.0, [*at_db(10, -3.1, -3.1), outside]))
    assert verdicts(result) == ["kept", "dropped", "dropped", "kept"]


def test_layers_taken_back_report_their_own_worst_condition(make_model: ModelMaker) -> None:
    model = make_model(0.0, at_db(10, -2.0, -2.0))
    gains = model.gains.copy()
    gains[1, 0, 2] *= 10 ** (1 / 20)
    result = run(TextureModel(**{**fields_of(model), "gains": gains}))
    assert verdicts(result) == ["kept", "dropped", "kept"]
    back = result.layers[2]
    assert "not together" in back.reason
    assert back.distance_db == pytest.approx(-1.0)
    assert (back.worst_speed_mm_s, back.worst_force_n) == (300.0, 1.0)
    assert back.flip_probability == 0


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.integers(-120, 30), min_size=2, max_size=7, unique=True),
    st.randoms(use_true_random=False),
    st.floats(0, 1),
)
def test_verdicts_do_not_depend_on_the_order_of_layers(
    levels: list[int], random: Random, level_sd_db: float
) -> None:
    """Levels in tenths of a dB, none twice: of two equal ones either may be the one to stay."""
    order = list(range(len(levels)))
    random.shuffle(order)
    model = flat_model([level / 10 for level in levels], level_sd_db)
    there = verdicts(run(model))
    again = verdicts(run(model.with_layers(order)))
    assert again == [there[layer] for layer in order]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-12, 3), min_size=1, max_size=7), st.floats(0, 1), st.floats(0, 6))
def test_signs_do_not_matter_and_a_margin_only_keeps_more(
    levels_db: list[float], level_sd_db: float, margin_db: float
) -> None:
    model = flat_model(levels_db, level_sd_db)
    mirrored = TextureModel(**{**fields_of(model), "gains": -model.gains})
    assert run(mirrored).layers == run(model).layers
    wider = verdicts(run(model, margin_db=margin_db)).count("dropped")
    assert wider <= verdicts(run(model)).count("dropped")


def test_last_layer_is_kept(make_model: ModelMaker) -> None:
    result = run(make_model(0.0, at_db(-40, -20, -30)))
    assert verdicts(result) == ["dropped", "kept", "dropped"]
    assert result.layers[1].reason == "below threshold, kept as the last layer"
    assert result.model.n_parameters == 4


def test_no_layers_to_begin_with(make_model: ModelMaker) -> None:
    result = run(make_model(0.1, []))
    assert result.layers == ()
    assert result.model.n_layers == 0


def test_no_threshold_known(make_model: ModelMaker) -> None:
    quiet = (1500.0, 50.0, 1e-6)
    result = run(make_model(0.0, [*at_db(10, -20), quiet]), hold_above=False)
    layer = result.layers[2]
    assert verdicts(result) == ["kept", "dropped", "kept"]
    assert layer.reason == "no threshold known in 4 of 4 conditions (flat covers 10 to 1000 Hz)"
    assert np.isnan(layer.distance_db)
    assert np.isnan(layer.flip_probability)
    assert layer.worst_frequency_hz == 1500.0
    assert layer.assumed == 0


def one_condition_beyond(model: TextureModel, frequency_hz: float) -> TextureModel:
    """The second layer of the last condition somewhere else."""
    frequencies = model.frequencies_hz.copy()
    frequencies[1, 1, 1] = frequency_hz
    return TextureModel(**{**fields_of(model), "frequencies_hz": frequencies})


@pytest.mark.parametrize(("frequency_hz", "hold_above"), [(1200.0, False), (5.0, True)])
def test_threshold_unknown_in_some_conditions_keeps_the_layer(
    make_model: ModelMaker, frequency_hz: float, hold_above: bool
) -> None:
    """Above the table unless its last level is held; below it in any case."""
    changed = one_condition_beyond(make_model(0.0, at_db(10, -20)), frequency_hz)
    layer = run(changed, hold_above=hold_above).layers[1]
    assert layer.verdict == "kept"
    assert layer.reason.startswith("no threshold known in 1 of 4 conditions")
    assert layer.distance_db == pytest.approx(-20)


def test_below_the_last_level_of_the_table_a_layer_may_go(make_model: ModelMaker) -> None:
    """A lower bound of the threshold above its end: docs/method/perception.md#above-the-table."""
    quiet = (1500.0, 50.0, 0.1 * 10 ** (-14 / 20))
    result = run(make_model(0.0, [*at_db(10, -20), quiet]))
    layer = result.layers[2]
    assert verdicts(result) == ["kept", "dropped", "dropped"]
    assert layer.reason == "below threshold in every condition (assumed in 4 of 4)"
    assert layer.distance_db == pytest.approx(-14)
    assert layer.assumed == 4
    in_one = run(one_condition_beyond(make_model(0.0, at_db(10, -20)), 1200.0)).layers[1]
    assert in_one.reason == "below threshold in every condition (assumed in 1 of 4)"


def test_above_the_last_level_of_the_table_nothing_is_known(make_model: ModelMaker) -> None:
    loud = (1500.0, 50.0, 0.1 * 10 ** (1 / 20))
    result = run(make_model(0.0, [*at_db(10, -20), loud]))
    layer = result.layers[2]
    assert verdicts(result) == ["kept", "dropped", "kept"]
    assert layer.reason == "no threshold known in 4 of 4 conditions (flat covers 10 to 1000 Hz)"
    assert np.isnan(layer.distance_db)
    assert layer.assumed == 0
    near = run(make_model(0.0, [*at_db(10), (1500.0, 50.0, 0.09)]), margin_db=2.0)
    assert verdicts(near) == ["kept", "kept"]


def test_above_threshold_wins_over_no_threshold_known(make_model: ModelMaker) -> None:
    """A layer that is surely felt in one condition needs no threshold in the others."""
    changed = one_condition_beyond(make_model(0.0, at_db(10, 3)), 1200.0)
    layer = run(changed, hold_above=False).layers[1]
    assert (layer.verdict, layer.reason) == ("kept", "above threshold in 3 of 4 conditions")


def test_what_fills_the_shape_of_a_layer_stays_with_it(make_model: ModelMaker) -> None:
    """60 dB too quiet alone; but it flattens the top of the layer that is felt."""
    level = Threshold("two", np.array([10.0, 300.0, 301.0, 1000.0]), [0.01, 0.01, 10, 10], "", "")
    shape = [(280.0, 80.0, 1.0), (330.0, 80.0, -0.75)]
    alone = simplify(make_model(0.0, [*shape, (900.0, 20.0, 0.5)]), level, criterion="paper-gain")
    assert verdicts(alone) == ["kept", "kept", "dropped"]
    assert [layer.fills for layer in alone.layers] == [0, 1, 0]
    assert alone.layers[1].reason == "below threshold, but fills the shape of layer 1"


def test_what_fills_a_shape_goes_with_it(make_model: ModelMaker) -> None:
    shape = [(280.0, 80.0, 0.04), (330.0, 80.0, -0.03), (900.0, 20.0, 0.2)]
    result = run(make_model(0.0, shape))
    assert [layer.fills for layer in result.layers] == [0, 1, 0]
    assert verdicts(result) == ["dropped", "dropped", "kept"]


def test_a_layer_stays_with_what_fills_its_shape(make_model: ModelMaker) -> None:
    level = Threshold("two", np.array([10.0, 300.0, 301.0, 1000.0]), [10, 10, 0.01, 0.01], "", "")
    shape = [(280.0, 80.0, 1.0), (330.0, 80.0, -0.75)]
    result = simplify(make_model(0.0, shape), level, criterion="paper-gain")
    assert verdicts(result) == ["kept", "kept"]
    assert result.layers[0].reason == "below threshold, but layer 2 fills its shape"


def test_what_fills_the_shape_of_the_last_layer_stays(make_model: ModelMaker) -> None:
    """Nothing can be felt; the loudest layer is kept, and with it what belongs to it."""
    result = run(make_model(0.0, [(280.0, 80.0, 0.04), (330.0, 80.0, -0.03)]))
    assert verdicts(result) == ["kept", "kept"]
    assert result.layers[0].reason == "below threshold, kept as the last layer"


def test_margin_lowers_the_bar(make_model: ModelMaker) -> None:
    model = make_model(0.0, at_db(10, -5))
    assert verdicts(run(model, margin_db=4.9)) == ["kept", "dropped"]
    assert verdicts(run(model, margin_db=5.1)) == ["kept", "kept"]
    assert run(model, margin_db=4.9).layers[1].distance_db == pytest.approx(-5)
    assert run(model, margin_db=4.9).margin_db == 4.9


def test_silent_layers_go(make_model: ModelMaker) -> None:
    result = run(make_model(0.0, [*at_db(10), (200.0, 50.0, 0.0)], level_sd_db=0.3))
    assert verdicts(result) == ["kept", "dropped"]
    assert result.layers[1].distance_db == -np.inf
    assert result.layers[1].flip_probability == 0


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_criterion_decides(make_model: ModelMaker, criterion: str) -> None:
    """A 50 Hz layer 6 dB above under `energy` is 14 dB below under `paper-fft`."""
    k = np.tan(np.pi * 50 / 5000)
    gain = 0.2 / np.sqrt(2 * k / (1 + k))
    # The other one is silent, so that by `energy` this one counts as if it were alone.
    model = make_model(0.0, [(100.0, 50.0, 0.0), (200.0, 50.0, gain)])
    threshold = replace(FLAT, frequency_hz=np.array([1e-6, 1e6]))
    layer = simplify(model, threshold, criterion=criterion).layers[1]  # type: ignore[arg-type]
    expected = {"energy": (6.02, "above"), "paper-fft": (-13.85, "below")}
    expected["paper-gain"] = (18.17, "above")
    assert layer.distance_db == pytest.approx(expected[criterion][0], abs=0.05)
    last = "kept as the last layer" in layer.reason
    assert last == (expected[criterion][1] == "below")


# --- stability


def test_flip_probability_agrees_with_monte_carlo(make_model: ModelMaker) -> None:
    """What scatters by 0.6 dB in energy does so by 1.2 dB in gain."""
    model = make_model(0.0, at_db(10, -1.5, -4.0, 0.4), level_sd_db=0.6)
    rng = np.random.default_rng(0)
    measured = distances_db(model, FLAT, criterion="paper-gain").reshape(4, 4)
    others = measured + 1.2 * rng.standard_normal((200_000, 4, 4))
    below_again = (others < 0).all(axis=1).mean(axis=0)
    below_now = (measured < 0).all(axis=0)
    expected = np.where(below_now, 1 - below_again, below_again)
    result = run(model)
    assert [x.flip_probability for x in result.layers] == pytest.approx(expected, abs=0.004)
    assert verdicts(result) == ["kept", "kept", "dropped", "kept"]
    assert "too short to be certain" in result.layers[1].reason


@pytest.mark.parametrize(("level_db", "verdict"), [(-2.2, "kept"), (-2.27, "dropped")])
def test_flips_of_5_percent_are_the_limit(
    make_model: ModelMaker, level_db: float, verdict: str
) -> None:
    """Four conditions at z: 1 − Φ(z)⁴ = 5 % at z = 2.234."""
    model = make_model(0.01, [(100.0, 50.0, 10.0), (200.0, 50.0, 1.0)], level_sd_db=1.0)
    everywhere = replace(FLAT, frequency_hz=np.array([1e-6, 1e6]))
    distance = float(distances_db(model, everywhere)[0, 0, 1])
    level_g = FLAT.acceleration_g * 10 ** ((distance - level_db) / 20)
    layer = simplify(model, replace(everywhere, acceleration_g=level_g)).layers[1]
    assert layer.distance_db == pytest.approx(level_db)
    assert layer.verdict == verdict
    assert (layer.flip_probability < 0.05) == (verdict == "dropped")


def test_flip_probability_is_that_of_the_bar_with_its_margin(make_model: ModelMaker) -> None:
    model = make_model(0.0, at_db(10, -5.0), level_sd_db=0.5)
    without, with_margin = (run(model, margin_db=m).layers[1] for m in (0.0, 3.0))
    assert without.flip_probability == pytest.approx(1 - ndtr(5.0) ** 4, rel=1e-6)
    assert with_margin.flip_probability == pytest.approx(1 - ndtr(2.0) ** 4, rel=1e-6)
    assert (without.verdict, with_margin.verdict) == ("dropped", "kept")


def test_a_kept_layer_flips_only_if_it_falls_below_everywhere(make_model: ModelMaker) -> None:
    """+1 dB in one condition, −1 dB in three: Φ(−1)·Φ(1)³."""
    model = make_model(0.0, at_db(10, -1.0), level_sd_db=0.5)
    gains = model.gains.copy()
    gains[0, 0, 1] = 0.1 * 10 ** (1 / 20)
    layer = run(TextureModel(**{**fields_of(model), "gains": gains})).layers[1]
    assert layer.verdict == "kept"
    assert layer.flip_probability == pytest.approx(ndtr(-1.0) * ndtr(1.0) ** 3, rel=1e-6)


def test_known_levels_never_flip(make_model: ModelMaker) -> None:
    result = run(make_model(0.0, at_db(10, -0.01)))
    assert [layer.flip_probability for layer in result.layers] == [0, 0]
    assert verdicts(result) == ["kept", "dropped"]


# --- refusals


def test_arbitrary_units_are_refused(make_model: ModelMaker) -> None:
    with refused(InputError, names="planted", expected="g", got="'arbitrary'"):
        run(make_model(0.0, at_db(1), unit="arbitrary"))


@pytest.mark.parametrize("margin_db", [-0.1, np.nan, np.inf])
def test_wrong_margins_are_refused(make_model: ModelMaker, margin_db: float) -> None:
    with refused(InputError, expected=["margin", "0 dB"], got=margin_db):
        run(make_model(0.0, at_db(1)), margin_db=margin_db)


def test_unknown_criteria_are_refused(make_model: ModelMaker) -> None:
    with refused(InputError, expected=["energy", "paper-fft", "paper-gain"], got="'loudness'"):
        run(make_model(0.0, at_db(1)), criterion="loudness")


# --- signs of those that stay (docs/method/perception.md#signs-of-the-rest)

ALTERNATING = [(300.0, 40.0, 0.5), (400.0, 60.0, -0.35), (500.0, 40.0, 0.5)]


def test_two_neighbours_left_with_equal_signs_are_made_to_alternate(
    make_model: ModelMaker,
) -> None:
    model = make_model(0.02, ALTERNATING)
    fewer = model.with_layers([0, 2])
    again = with_signs_chosen_again(model, [0, 2])
    assert (np.sign(fewer.gains) == [1, 1]).all()
    assert (again.gains[:, :, 0] * again.gains[:, :, 1] < 0).all()
    assert (np.abs(again.gains) == np.abs(fewer.gains)).all()
    between = np.arange(330.0, 470.0)
    filled = again.peq(200.0, 2.0).response(between)
    full = model.peq(200.0, 2.0).response(between)
    hole = fewer.peq(200.0, 2.0).response(between)
    assert hole.min() < 0.5 * full.min()
    assert filled.min() > 0.8 * full.min()


def test_a_hole_that_the_full_model_has_is_kept(make_model: ModelMaker) -> None:
    model = make_model(0.02, [(150.0, 60.0, 0.5), (350.0, 60.0, 0.5), (1500.0, 50.0, -0.03)])
    again = with_signs_chosen_again(model, [0, 1])
    assert (again.gains == [0.5, 0.5]).all()


@pytest.mark.parametrize("estimator", ["paper", "paper-consistent"])
def test_models_by_the_papers_recipe_keep_their_signs(
    make_model: ModelMaker, estimator: str
) -> None:
    model = replace(make_model(0.02, ALTERNATING), estimator=estimator)
    again = with_signs_chosen_again(model, [0, 2])
    assert (again.gains == model.gains[:, :, [0, 2]]).all()
    assert (again.frequencies_hz == model.frequencies_hz[:, :, [0, 2]]).all()


def test_where_nothing_is_dropped_nothing_changes(make_model: ModelMaker) -> None:
    model = make_model(0.02, [(150.0, 60.0, 0.5), (350.0, 60.0, 0.5)])
    again = with_signs_chosen_again(model, [0, 1])
    for name in ("gains", "frequencies_hz", "bandwidths_hz", "noise_gains", "level_sd_db"):
        assert (getattr(again, name) == getattr(model, name)).all()


@pytest.mark.parametrize("keep", [[], [0], [1], [0, 2], [0, 1]])
def test_whatever_stays_keeps_its_amplitudes_and_one_sign(
    make_model: ModelMaker, keep: list[int]
) -> None:
    """Also where the strongest force and fastest speed are silent, and tell no sign."""
    planted = make_model(0.02, ALTERNATING)
    gains = planted.gains.copy()
    gains[-1, -1] = 0.0
    model = replace(planted, gains=gains)
    again = with_signs_chosen_again(model, keep)
    assert (np.abs(again.gains) == np.abs(gains[:, :, keep])).all()
    signs = np.sign(again.gains).reshape(4, len(keep))[:-1]
    assert (signs == signs[0]).all()


def test_simplify_chooses_signs_again(make_model: ModelMaker) -> None:
    high = Threshold("high", np.array([10.0, 1000.0]), np.array([0.4, 0.4]), "planted", "none")
    simplified = simplify(make_model(0.02, ALTERNATING), high, criterion="paper-gain").model
    assert simplified.n_layers == 2
    assert (simplified.gains[:, :, 0] * simplified.gains[:, :, 1] < 0).all()


def test_reasons_of_the_change_of_power(make_model: ModelMaker) -> None:
    """Of narrow layers far apart, at +3, −3 and −20 dB."""
    threshold = Threshold("flat", np.array([1e-6, 1000.0]), np.array([0.1, 0.1]), "", "")
    k = np.tan(np.pi * 0.3 / 5000)
    unit = 0.1 / np.sqrt(2 * k / (1 + k))
    levels = (3.0, -3.5, -20.5)
    layers = [(200.0 * (n + 1), 0.3, unit * 10 ** (db / 20)) for n, db in enumerate(levels)]
    model = make_model(0.0, layers)

    def reasons(model: TextureModel, **options: float) -> list[str]:
        return [layer.reason for layer in simplify(model, threshold, **options).layers]  # type: ignore[arg-type]

    below = "dropping it changes the power by {} dB less than the threshold in every condition"
    above = "dropping it changes the power by more than the threshold {}in 4 of 4 conditions"
    assert reasons(model)[0] == above.format("")
    assert reasons(model)[1].startswith("dropping it changes the power by 3.")
    assert reasons(model)[2] == below.format("20.0")
    assert reasons(model, margin_db=6.0)[:2] == [above.format("less 6 dB ")] * 2
    unsure = replace(model, level_sd_db=np.full(model.gains.shape, 5.0))
    assert reasons(unsure)[1] == (
        "dropping it changes the power by less than the threshold, but the records are too short "
        "to be certain"
    )
    silent = replace(model, gains=model.gains * [0.5, 0.0, 0.2])
    assert reasons(silent) == [
        "dropping it changes the power by less than the threshold, kept as the last layer",
        "dropping it changes nothing in any condition",
        reasons(silent)[2],
    ]
    twice = make_model(0.0, [layers[0], layers[1], (600.0, 0.3, layers[1][2])])
    assert (
        "dropping it changes the power by less than the threshold, but not together with the "
        "other dropped" in reasons(replace(twice, gains=twice.gains * [1.0, 1.2, 1.1]))
    )
    beyond = make_model(0.0, [layers[0], (1500.0, 0.3, unit * 10)])
    assert (
        reasons(beyond)[1]
        == "no threshold known in 4 of 4 conditions (flat covers 1e-06 to 1000 Hz)"
    )


def test_reasons_name_the_margin(make_model: ModelMaker) -> None:
    model = make_model(0.01, at_db(3.0, -2.0, -20.0))
    reasons = [layer.reason for layer in run(model, margin_db=6.0).layers]
    assert reasons[:2] == ["not 6 dB below threshold in 4 of 4 conditions"] * 2
    assert reasons[2] == "6 dB below threshold in every condition"
    plain = [layer.reason for layer in run(model).layers]
    assert plain[0] == "above threshold in 4 of 4 conditions"
    assert plain[2] == "below threshold in every condition"


def test_a_simplified_model_knows_its_full_one_and_a_full_one_keeps_its_hash(
    make_model: ModelMaker, tmp_path: Path
) -> None:
    model = make_model(0.07, at_db(6, -20, 0.5, -30))
    assert "simplified_from" not in model.to_dict()
    fewer = run(model).model
    assert fewer.simplified_from == model.sha256
    assert fewer.at_rate(8000.0).simplified_from == model.sha256
    assert fewer.with_layers([0]).simplified_from == model.sha256
    fewer.save(tmp_path / "fewer.json")
    assert TextureModel.load(tmp_path / "fewer.json") == fewer
    again = run(fewer)
    assert again.identical
    assert again.model.simplified_from == model.sha256
    loud = make_model(0.07, at_db(6, 3))
    assert run(loud).identical
    assert run(loud).model.simplified_from == ""
