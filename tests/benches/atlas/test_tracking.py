"""Tracking in the atlas: scenes are what they say, names are counted right, theory is met."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.benches.atlas import tracking
from tactileq.benches.atlas.case import FAILS, HOLDS, Case
from tactileq.benches.atlas.tracking import CASES, EITHER, JOINT, WIDTH_HZ, planted
from tactileq.modeling import TextureModel


def case_of(axis: str, method: str) -> Case:
    return next(c for c in CASES if c.axis.name.startswith(axis) and c.method == method)


def scene(step_hz: float = 10.0) -> TextureModel:
    frequency = np.column_stack((200 + step_hz * np.arange(4), 500 - step_hz * np.arange(4)))
    return planted(frequency, np.full(frequency.shape, 5.0))


def swapped(truth: TextureModel, conditions: list[int]) -> TextureModel:
    frequency = truth.frequencies_hz.copy()
    frequency[conditions] = frequency[conditions][..., ::-1]
    return replace(truth, frequencies_hz=frequency)


def test_names_are_wrong_where_they_differ_from_elsewhere() -> None:
    truth = scene()
    assert tracking.wrong_names((truth, truth)) == 0
    assert tracking.wrong_names((truth, swapped(truth, [0, 1, 2, 3]))) == 0  # only called otherwise
    assert tracking.wrong_names((truth, swapped(truth, [3]))) == pytest.approx(2 / 8)
    assert tracking.wrong_names((truth, swapped(truth, [2, 3]))) == pytest.approx(4 / 8)
    assert tracking.wrong_names((truth, truth.with_layers([1]))) == pytest.approx(4 / 8)
    far = replace(truth, frequencies_hz=truth.frequencies_hz + 100)
    assert tracking.wrong_names((truth, far)) == 1


def test_the_level_of_a_layer_that_is_gone_is_what_is_left_there() -> None:
    frequency = np.full((3, 2), 500.0) - np.array([300.0, 0.0])
    truth = planted(frequency, np.column_stack((np.full(3, 8.0), [8.0, 8.0, 1e-6])))
    assert tracking.changing_level_error_db((truth, truth)) == 0
    everywhere = planted(frequency, np.full((3, 2), 8.0))
    alone = 10 * np.log10(
        np.mean(
            everywhere.peq(200.0, 2.0).response(500 + WIDTH_HZ * np.linspace(-0.5, 0.5, 26)) ** 2
        )
        / np.mean(truth.peq(200.0, 2.0).response(500 + WIDTH_HZ * np.linspace(-0.5, 0.5, 26)) ** 2)
    )
    error = tracking.changing_level_error_db((truth, everywhere))
    assert error == pytest.approx(alone / np.sqrt(3))


def test_scenes_move_cross_change_and_stand_as_far_apart_as_they_say() -> None:
    moved, _ = tracking.moving(0.4, np.nan)
    assert np.diff(moved, axis=0) == pytest.approx(0.4 * tracking.GAP_HZ)
    assert np.diff(moved, axis=1) == pytest.approx(tracking.GAP_HZ)
    crossed, _ = tracking.crossing(2.0, np.nan)
    offset = (crossed[:, 1] - crossed[:, 0]) / WIDTH_HZ
    assert offset == pytest.approx([-3.0, -1.0, 1.0, 3.0])
    for direction in (1.0, -1.0):
        _, heights = tracking.changing(16.0, direction)
        assert heights[:, 0] == pytest.approx(tracking.HEIGHT)
        fall = heights[:: int(direction), 1] / tracking.HEIGHT
        assert fall == pytest.approx([1.0, 1 / 4, 1 / 16])
    near, _ = tracking.neighbouring(3.0, np.nan)
    assert np.diff(near, axis=1) == pytest.approx(3.0 * WIDTH_HZ)


def test_the_papers_names_swap_past_half_the_gap() -> None:
    case = case_of("jump", EITHER)
    assert case.verdict(case.measure(0.4, np.nan, full=True)) == HOLDS
    assert case.verdict(case.measure(0.6, np.nan, full=True)) == FAILS


def test_the_fields_names_do_not() -> None:
    case = case_of("jump", JOINT)
    for jump in (case.axis.mild, 0.6, case.axis.severe):
        assert case.verdict(case.measure(jump, np.nan, full=False)) == HOLDS


def test_a_layer_that_comes_or_goes_keeps_its_level_in_the_field_only() -> None:
    ours, papers = (case_of("change", method) for method in (JOINT, EITHER))
    for direction in ours.columns.values():
        assert ours.verdict(ours.measure(16.0, direction, full=False)) == HOLDS
        assert papers.verdict(papers.measure(16.0, direction, full=False)) == FAILS


def test_two_layers_on_one_peak_are_one() -> None:
    for method in (JOINT, EITHER):
        case = case_of("spacing", method)
        assert case.verdict(case.measure(case.axis.mild, np.nan, full=False)) == HOLDS
        assert case.verdict(case.measure(case.axis.severe, np.nan, full=False)) == FAILS
    merging = tracking.spacing_of_merging(np.nan)
    assert merging == pytest.approx(2 * np.hypot(30, 25 / 1.36) / 25)
    papers = case_of("spacing", EITHER)
    assert papers.verdict(papers.measure(0.8 * merging, np.nan, full=False)) == FAILS


def test_layers_that_cross_in_small_steps_are_taken_for_one_another() -> None:
    for method in (JOINT, EITHER):
        case = case_of("step", method)
        assert case.verdict(case.measure(case.axis.severe, np.nan, full=False)) == FAILS
    ours = case_of("step", JOINT)
    assert ours.verdict(ours.measure(ours.axis.mild, np.nan, full=False)) == HOLDS
