"""Verdicts in the atlas: thresholds lie where they should, shares count what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.benches.atlas import verdicts
from tactileq.benches.atlas.case import Case
from tactileq.benches.atlas.verdicts import ALL_RULES, BY_LEVEL, CASES, RULES, planted
from tactileq.modeling import TextureModel
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.seeds import generator

LAYERS = len(verdicts.PLACES_HZ)


def case_of(measure: str, method: str) -> Case:
    words = {
        "wrongly": "layers dropped",
        "in vain": "layers kept",
        "contradicted": "dropped, but",
    }[measure]
    return next(c for c in CASES if c.method == method and c.figure.startswith(words))


def read_as(truth: TextureModel, *, error_db: float, sd_db: float) -> TextureModel:
    factor = 10 ** (error_db / 20)
    return replace(
        truth,
        noise_gains=truth.noise_gains * factor,
        gains=truth.gains * factor,
        level_sd_db=np.full(truth.gains.shape, sd_db),
        estimator="joint",
    )


def pairs_of(errors_db: tuple[float, float], *, sd_db: float) -> tuple[verdicts.Pair, ...]:
    truths = [planted(generator([1, n])) for n in range(3)]
    first, second = (
        [read_as(truth, error_db=error_db, sd_db=sd_db) for truth in truths]
        for error_db in errors_db
    )
    return tuple(zip(truths, zip(first, second, strict=True), strict=True))


def test_the_threshold_is_so_far_from_the_change_by_one_layer() -> None:
    """By a sum over frequency."""
    truth = planted(generator(3))
    frequency = np.arange(0.05, 2500.0, 0.1)
    for layer in range(LAYERS):
        threshold = verdicts.threshold_at(truth, layer, -2.5)
        others = [other for other in range(LAYERS) if other != layer]
        powers = [
            model.peq(200.0, 2.0).response(frequency) ** 2
            for model in (truth, with_signs_chosen_again(truth, others))
        ]
        change = 2 * np.mean(np.abs(powers[0] - powers[1]))
        assert 10 * np.log10(change / threshold.at(300.0) ** 2) == pytest.approx(-2.5, abs=0.01)


@pytest.mark.parametrize("method", RULES)
def test_far_from_the_threshold_no_verdict_is_wrong(method: str) -> None:
    for measure in ("wrongly", "in vain", "contradicted"):
        assert case_of(measure, method).measure(25.0, 1.0, full=False) == 0


def test_near_it_all_rules_are_cautious_and_levels_alone_are_not() -> None:
    wrongly = [case_of("wrongly", m).measure(0.1, 1.0, full=False) for m in RULES]
    assert wrongly[0] <= verdicts.WRONG < verdicts.WRONG_AT_MOST < wrongly[1]
    in_vain = [case_of("in vain", m).measure(0.9, 1.0, full=False) for m in RULES]
    assert in_vain[0] > in_vain[1]
    assert in_vain[0] >= verdicts.IN_VAIN_AT_MOST


def test_shares_count_layers_and_second_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    def tell(errors_db: tuple[float, float], sd_db: float) -> None:
        pairs = pairs_of(errors_db, sd_db=sd_db)
        monkeypatch.setattr(verdicts, "recorded_twice", lambda textures, duration_s: pairs)

    tell((-2.0, 2.0), 0.1)
    for method in RULES:
        assert case_of("wrongly", method).measure(1.0, 1.0, full=False) == 0.5
        assert case_of("in vain", method).measure(1.0, 1.0, full=False) == 0.5
        # Of the two, the one that drops is contradicted by the other.
        assert case_of("contradicted", method).measure(1.0, 1.0, full=False) == 0.5
        assert case_of("contradicted", method).measure(3.0, 1.0, full=False) == 0.0
    tell((-2.0, 2.0), 3.0)  # too uncertain for P(flip) < 5 %
    assert case_of("contradicted", ALL_RULES).measure(1.0, 1.0, full=False) == 0.0
    assert case_of("contradicted", BY_LEVEL).measure(1.0, 1.0, full=False) == 0.5
    assert case_of("in vain", ALL_RULES).measure(1.0, 1.0, full=False) == 1.0


def test_a_layer_that_is_not_found_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    ((truth, (first, second)), *_) = pairs_of((-20.0, -20.0), sd_db=0.1)
    fewer = second.with_layers([0, 1])
    pairs = ((truth, (first, fewer)),)
    gone, found = verdicts.dropped(pairs, 1.0, rule=verdicts.dropped_by_level)
    assert found[0, :, 0].all()
    assert found[0, :, 1].tolist() == [True, True, False, False]
    assert gone[found].all()
    assert not gone[~found].any()
    monkeypatch.setattr(verdicts, "recorded_twice", lambda textures, duration_s: pairs)
    assert case_of("wrongly", BY_LEVEL).measure(1.0, 1.0, full=False) == 1.0
    lost = ((truth, (first.with_layers([]), second.with_layers([]))),)
    monkeypatch.setattr(verdicts, "recorded_twice", lambda textures, duration_s: lost)
    assert case_of("wrongly", BY_LEVEL).measure(1.0, 1.0, full=False) == np.inf


def test_the_bound_of_a_level_is_the_lone_layers_where_it_is_loud() -> None:
    for width, duration in ((20.0, 1.0), (50.0, 2.0)):
        lone = 10 / np.log(10) / np.sqrt(np.pi * width * duration)
        assert verdicts._deviation_db(width, 60.0, duration, sign=1.0) == pytest.approx(
            lone, rel=0.1
        )
    quiet, loud = (verdicts._deviation_db(30.0, level, 1.0, sign=1.0) for level in (6.0, 20.0))
    assert quiet > 1.3 * loud  # the floor takes its part
    assert np.median(verdicts.level_deviations_db(0.25) / verdicts.level_deviations_db(1.0)) == (
        pytest.approx(2.0, rel=0.03)
    )


def test_the_edges_of_normal_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verdicts, "level_deviations_db", lambda duration_s: np.array([1.0]))
    assert verdicts.above_by_normal_errors(1.0) == pytest.approx(1.645, abs=1e-3)
    assert verdicts.below_by_normal_errors(1.0) == pytest.approx(0.8416, abs=1e-3)
    assert verdicts.below_by_all_rules(1.0) == pytest.approx(1.645 + 0.8416, abs=1e-3)
    z = verdicts.contradicted_by_normal_errors(1.0)
    assert verdicts.ndtr(z) * verdicts.ndtr(-z) == pytest.approx(verdicts.WRONG)


def test_levels_of_found_layers_scatter_as_the_bound_says() -> None:
    errors = [
        20 * np.log10(found / true)
        for truth, models in verdicts.recorded_twice(verdicts.TEXTURES[False], 1.0)
        for model in models
        for true, found in zip(
            layer_amplitudes_g(truth, criterion="energy")[0, 0],
            layer_amplitudes_g(model, criterion="energy")[0, 0][verdicts.partners(model, truth)],
            strict=True,
        )
    ]
    bound = np.sqrt(np.mean(verdicts.level_deviations_db(1.0) ** 2))
    assert len(errors) == 16
    # Sixteen levels: their deviation is known to 18 %.
    assert 0.6 * bound < np.std(errors) < 1.6 * bound
