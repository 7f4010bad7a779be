"""What a refusal must name, whatever its sentence: file or option, what was expected, what came.

The house's form is "expected …, got …; what to do." A fact is a name, a number or a unit that must
stand in its part of the sentence as a word of its own; the words around it are free to change.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def refused(
    error: type[Exception], *, names: object = (), expected: object = (), got: object = ()
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """`with refused(InputError, names=path, expected="mm/s", got=-3):` or fail.

    `names` may stand anywhere, `expected` before what came, `got` behind it; each is one fact or
    several in a list.
    """
    with pytest.raises(error) as caught:
        yield caught
    check_refusal(str(caught.value), names=names, expected=expected, got=got)


@contextmanager
def warned(*, names: object = (), expected: object = (), got: object = ()) -> Iterator[None]:
    """The same of a warning; others may come beside it."""
    with pytest.warns(UserWarning) as caught:  # noqa: PT030 - checked below
        yield
    for warning in caught:
        try:
            check_refusal(str(warning.message), names=names, expected=expected, got=got)
        except AssertionError:
            continue
        return
    raise AssertionError(
        f"expected a warning that names {names!r}, {expected!r} and {got!r}, "
        f"got {[str(warning.message) for warning in caught]}"
    )


def check_refusal(
    sentence: str, *, names: object = (), expected: object = (), got: object = ()
) -> None:
    """Fail unless each fact stands in its part of the sentence."""
    parts = _parts(sentence)
    facts = [
        (fact, part)
        for part, given in zip((sentence, *parts), (names, expected, got), strict=True)
        for fact in _listed(given)
    ]
    assert facts, "expected at least one fact that the refusal must name"
    assert all(str(fact) for fact, _ in facts), "expected facts, got an empty one"
    for fact, part in facts:
        assert _stands(str(fact), part), f"expected {fact!s} in {part!r} of {sentence!r}"


def _parts(sentence: str) -> tuple[str, str]:
    """What was expected and what came; the whole sentence where it does not have that form."""
    found = re.search(r"\bexpected\b(.*?)\bgot\b(.*)", sentence, re.DOTALL)
    return (found[1], found[2]) if found else (sentence, sentence)


def _listed(facts: object) -> Sequence[object]:
    return facts if isinstance(facts, (list, tuple)) else (facts,)


def _stands(fact: str, text: str) -> bool:
    """Whether it stands there, not as a part of a longer word or number."""
    begin = r"(?<![\w.])" if fact[:1].isalnum() else ""
    end = r"(?!\w|\.\d)" if fact[-1:].isalnum() else ""
    return re.search(begin + re.escape(fact) + end, text) is not None
