"""Checks of single values: what passes, what does not, and the sentence."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.checks import (
    check_choice,
    check_duration,
    check_name,
    check_number,
    check_rate,
    check_texture_name,
    check_whole,
    is_number,
    is_positive,
    is_whole,
)
from tactileq.modeling.errors import shown
from tests.refusals import refused

NUMBERS = (0, -3, 2.5, float("nan"), np.float64(1.5), np.float32(1.5), np.int64(4), np.uint8(4))
NEITHER = (True, False, np.bool_(True), "5", None, [5], 5j, b"5", Decimal(5), np.ones(2))


@pytest.mark.parametrize("value", NUMBERS)
def test_numbers(value: object) -> None:
    assert is_number(value)
    assert is_whole(value) == (not isinstance(value, float | np.floating))


@pytest.mark.parametrize("value", NEITHER)
def test_what_is_no_number(value: object) -> None:
    assert not is_number(value)
    assert not is_whole(value)
    for name, check in (
        ("gain", lambda: check_number("gain", value, high=10)),
        ("seed", lambda: check_whole("seed", value, low=0, high=10)),
        ("rate", lambda: check_rate(value)),
    ):
        with refused(InputError, names=name, got=shown(value)):
            check()


@pytest.mark.parametrize("value", [0, -1.0, float("nan"), float("inf"), np.float32("inf"), 10**400])
def test_rates_are_finite_and_above_zero(value: float) -> None:
    assert not is_positive(value)
    with refused(InputError, expected=["rate", 1, "10000000 Hz"], got=shown(value)):
        check_rate(value)
    assert is_positive(5e-324)
    assert is_positive(np.float32(5000))


def test_ends_of_a_range_are_in_it() -> None:
    check_number("gain", 0, high=10)
    check_number("gain", 10.0, high=10)
    check_whole("seed", np.int64(10), low=0, high=10)
    with refused(InputError, expected=["gain", 0, 10], got=10.1):
        check_number("gain", 10.1, high=10)
    with refused(InputError, expected=["seed", 0, 10], got=11):
        check_whole("seed", 11, low=0, high=10)


def test_words() -> None:
    check_choice("mode", "rms", ("rms", "peak"))
    check_name("a label", "full · 1")
    with refused(InputError, expected=["mode", '"rms"', '"peak"'], got="'loud'"):
        check_choice("mode", "loud", ("rms", "peak"))
    for name in ("", "  ", "two\nlines", 5):
        with refused(InputError, expected="a label", got=shown(name)):
            check_name("a label", name)


@pytest.mark.parametrize("value", [5e-324, 1e-308, 0.5, 0.999])
def test_rates_start_at_one_hertz(value: float) -> None:
    check_rate(1)
    with refused(InputError, expected=["rate", 1, "10000000 Hz"], got=shown(value)):
        check_rate(value)


def test_rates_and_durations_have_upper_ends() -> None:
    check_rate(1e7)
    check_duration(1.0, 1e7)
    with refused(InputError, expected="10000000 Hz", got=10000001):
        check_rate(10_000_001)
    for duration_s in (0, -1, float("nan"), float("inf")):
        with refused(InputError, expected="0 s", got=shown(duration_s)):
            check_duration(duration_s, 5000.0)
    with refused(InputError, expected=["2000 s", "5000 Hz", 10000000], got="1e+300 s"):
        check_duration(1e300, 5000.0)


def test_names_are_short() -> None:
    check_texture_name("x" * 100)
    with refused(InputError, expected=["texture name", 100], got=[5000, shown("x" * 5000)]):
        check_texture_name("x" * 5000)
