"""Peaks of their own, and what only fills the shape of another: judged on planted responses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import TextureModel
from tactileq.modeling.models.own_peaks import own_peaks

ModelMaker = Callable[..., TextureModel]
PEAK = (280.0, 80.0, 1.0)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.floats(0.1, 1.0), min_size=1, max_size=5))
def test_layers_far_apart_are_peaks(make_model: ModelMaker, gains: list[float]) -> None:
    model = make_model(0.01, [(150.0 * 2**n, 20.0, gain) for n, gain in enumerate(gains[:4])])
    found = own_peaks(model)
    assert found.is_peak.all()
    assert (found.fills == -1).all()


@pytest.mark.parametrize(
    "filler", [(330.0, 80.0, -0.75), (310.0, 80.0, -0.4), (320.0, 150.0, -0.5)]
)
def test_a_layer_without_a_maximum_fills_its_neighbour(
    make_model: ModelMaker, filler: tuple[float, float, float]
) -> None:
    model = make_model(0.0, [PEAK, filler, (1000.0, 40.0, 0.3)])
    frequency = np.arange(200.0, 500.0)
    response = model.peq(100.0, 1.0).response(frequency)
    maxima = np.flatnonzero((response[1:-1] > response[:-2]) & (response[1:-1] >= response[2:]))
    assert maxima.size == 1  # one peak, as the test means it
    found = own_peaks(model)
    assert found.is_peak.tolist() == [True, False, True]
    assert found.fills.tolist() == [-1, 0, -1]


def test_a_hidden_layer_fills_nothing(make_model: ModelMaker) -> None:
    """30 dB below the skirt of a loud one it is no peak, and no shape hangs on it."""
    found = own_peaks(make_model(0.0, [PEAK, (420.0, 30.0, 0.003)]))
    assert found.is_peak.tolist() == [True, False]
    assert found.fills.tolist() == [-1, -1]


def test_most_conditions_decide(make_model: ModelMaker) -> None:
    """In one condition of four it fills; in three of four it is a peak."""
    model = make_model(0.0, [PEAK, (700.0, 40.0, -0.5)])
    frequencies = model.frequencies_hz.copy()
    frequencies[0, 0, 1] = 300.0
    assert own_peaks(replace(model, frequencies_hz=frequencies)).is_peak.all()
    frequencies[:, :, 1] = 300.0
    frequencies[0, 0, 1] = 700.0
    assert own_peaks(replace(model, frequencies_hz=frequencies)).is_peak.tolist() == [True, False]


def test_foretold_conditions_do_not_decide(make_model: ModelMaker) -> None:
    model = make_model(0.0, [PEAK, (700.0, 40.0, -0.5)])
    frequencies = model.frequencies_hz.copy()
    frequencies[0, 0, 1] = frequencies[0, 1, 1] = frequencies[1, 0, 1] = 300.0
    predicted = np.array([[True, True], [True, False]])
    mixed = replace(model, frequencies_hz=frequencies)
    assert own_peaks(mixed).is_peak.tolist() == [True, False]
    assert own_peaks(replace(mixed, interpolated=predicted)).is_peak.all()


def test_some_layer_is_always_a_peak(make_model: ModelMaker) -> None:
    """Of three in one place that cancel to a floor, the loudest counts."""
    found = own_peaks(make_model(1.0, [(300.0, 80.0, -0.2), (300.0, 80.0, -0.3)]))
    assert found.is_peak.tolist() == [False, True]
    assert own_peaks(make_model(1.0, [])).is_peak.size == 0


@settings(deadline=None, max_examples=40)
@given(st.permutations(range(4)))
def test_the_order_of_layers_does_not_matter(make_model: ModelMaker, order: list[int]) -> None:
    layers = [PEAK, (330.0, 80.0, -0.75), (1000.0, 40.0, 0.3), (1030.0, 50.0, -0.2)]
    there = own_peaks(make_model(0.0, layers))
    here = own_peaks(make_model(0.0, [layers[n] for n in order]))
    assert here.is_peak.tolist() == there.is_peak[order].tolist()
    named = [order[peak] if peak >= 0 else -1 for peak in here.fills]
    assert named == there.fills[order].tolist()
