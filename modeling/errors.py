"""The errors that users see."""

from __future__ import annotations


class InputError(ValueError):
    """Input that cannot be used; the message is one sentence: expected, got, what to do."""


class GridError(InputError):
    """Recordings that are good one by one, but do not span a grid of speeds and forces."""
