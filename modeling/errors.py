"""The one error that users see."""


class InputError(ValueError):
    """Input that cannot be used; the message is one sentence: expected, got, what to do."""
