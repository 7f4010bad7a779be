"""Transferred information where it is known."""

import numpy as np
import pytest

from tactileq.analysis.chapters.confusions.information import (
    corrected_bits,
    information_bits,
    transferred_information,
)
from tactileq.modeling import InputError
from tests.refusals import refused


@pytest.mark.parametrize("k", [3, 7, 16])
def test_all_right_is_log2_of_the_classes(k):
    found = transferred_information([5 * np.eye(k)] * 4)
    assert found.uncorrected == pytest.approx(np.log2(k))
    assert found.bits == pytest.approx(np.log2(k))
    assert np.isnan(found.ci_low)


def test_binary_channel_has_its_capacity():
    noise = 0.1 * np.log2(0.1) + 0.9 * np.log2(0.9)
    assert information_bits(np.array([[90.0, 10], [10, 90]])) == pytest.approx(1 + noise)


def test_a_textbook_example():
    # Cover and Thomas, Elements of Information Theory (2006), example 2.2.1: I(X; Y) = 3/8 bit.
    joint = np.array([[4, 2, 1, 1], [2, 4, 1, 1], [2, 2, 2, 2], [8, 0, 0, 0]]) / 32
    assert information_bits(joint) == pytest.approx(3 / 8)
    assert information_bits(320 * joint.T) == pytest.approx(3 / 8)


def test_correction_takes_chance_to_nothing():
    rng = np.random.default_rng(2)
    tables = rng.multinomial(60, np.full(7, 1 / 7), size=(400, 7)).astype(float)
    corrected = [corrected_bits(table) for table in tables]
    assert abs(np.mean(corrected)) < 0.005
    assert np.mean([information_bits(table) for table in tables]) > 0.05


def test_interval_encloses_the_value():
    draws = np.random.default_rng(3).multinomial(6, [0.7, 0.2, 0.1], size=(12, 3))
    one = transferred_information(draws)
    assert one.ci_low < one.bits < one.ci_high


def test_interval_is_that_of_the_mean_where_bits_are_nearly_linear():
    # With many trials each the pooled bits move by a hundredth of what each participant moves.
    draws = np.random.default_rng(3).multinomial(3000, [0.7, 0.2, 0.1], size=(12, 3))
    changes = [float(corrected_bits(draws.sum(axis=0) - one)) for one in draws]
    error = np.sqrt(11 / 12 * np.square(np.array(changes) - np.mean(changes)).sum())
    found = transferred_information(draws)
    assert (found.ci_high - found.ci_low) / 2 == pytest.approx(2.2009852 * error)  # t, 11 df


def test_a_class_never_answered_or_presented_changes_nothing():
    small = np.array([[8.0, 2], [3, 9]])
    assert corrected_bits(np.pad(small, (0, 1))) == pytest.approx(corrected_bits(small))


@pytest.mark.parametrize(
    ("counts", "expected", "got"),
    [
        (np.eye(3), "two participants", "(3, 3)"),
        ([np.eye(3)], "two participants", "(1, 3, 3)"),
        (np.zeros((0, 3, 3)), "two participants", "(0, 3, 3)"),
        ([np.eye(3), np.zeros((3, 3))], "answers", "matrix"),
    ],
)
def test_single_people_and_empty_matrices_are_refused(counts, expected, got):
    with refused(InputError, expected=expected, got=got):
        transferred_information(counts)


def test_nan_is_refused():
    with refused(InputError, expected=["counts", 0], got="nan"):
        transferred_information([np.eye(3), np.eye(3) * np.nan])
