"""The helper that looks for facts in refusals notices where one is missing."""

from __future__ import annotations

import warnings

import pytest

from tests.refusals import check_refusal, refused, warned

SENTENCE = "/a/rig.toml: expected stroke_hz from 0 to 20 Hz, got 21.5; lower it."


def test_facts_are_found_in_their_part() -> None:
    check_refusal(
        SENTENCE, names=["rig.toml", "stroke_hz"], expected=[0, 20, "Hz"], got=[21.5, "lower"]
    )


@pytest.mark.parametrize(
    "facts",
    [
        {"names": "scene.toml"},
        {"expected": 21.5},
        {"got": 20},
        {"got": 21},
        {"got": 1.5},
        {"names": "stroke"},
        {"expected": [20, "kHz"]},
        {},
    ],
    ids=str,
)
def test_a_fact_that_is_not_there_fails(facts: dict[str, object]) -> None:
    with pytest.raises(AssertionError):
        check_refusal(SENTENCE, **facts)


def test_an_error_is_looked_at_where_it_is_raised() -> None:
    with refused(ValueError, got=21.5) as caught:
        raise ValueError(SENTENCE)
    assert str(caught.value) == SENTENCE
    with pytest.raises(AssertionError), refused(ValueError, got=22.5):
        raise ValueError(SENTENCE)


def warn_twice() -> None:
    warnings.warn("another", stacklevel=1)
    warnings.warn(SENTENCE, stacklevel=1)


def test_one_warning_of_several_has_to_tell_all() -> None:
    with warned(names="rig.toml", got=21.5):
        warn_twice()
    with pytest.raises(AssertionError), warned(names="rig.toml", got="another"):
        warn_twice()
