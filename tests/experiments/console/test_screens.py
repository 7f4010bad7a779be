"""Numbers of screens, without one."""

from __future__ import annotations

import pytest

from experiments.console import screens
from modeling import InputError


def test_the_only_screen_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(screens, "_screen_count", lambda: 1)
    screens.check_screen(0)
    with pytest.raises(InputError, match=r"a screen \(0, the only one\), got 1;"):
        screens.check_screen(1)
