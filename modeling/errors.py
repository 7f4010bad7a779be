"""The errors that users see."""


class InputError(ValueError):
    """Input that cannot be used; the message is one sentence: expected, got, what to do."""


class GridError(InputError):
    """Recordings that are good one by one, but do not span a grid of speeds and forces."""


def check_texture_name(name: object) -> None:
    """Refuse what cannot be a texture's name in a table: anything but one line of text."""
    if not isinstance(name, str) or not name.strip() or any(c in name for c in "\t\r\n"):
        raise InputError(
            f"expected a texture name of one line without tabs, got {name!r}; name it."
        )
