"""What progress bars print."""

from __future__ import annotations

import pytest

from tactileq.printing import progress, share_of


@pytest.mark.parametrize("name", ["[/b]x", "[red]oak", "a [1]"])
def test_names_are_no_markup(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with progress(f"Recording {name}", 1) as advance:
        advance(name)
    with share_of(f"Compiling {name}") as tell:
        tell(1.0, name)
    printed = capsys.readouterr().out
    assert f"Recording {name}" in printed
    assert f"Compiling {name}" in printed
