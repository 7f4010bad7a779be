"""Patience with chips that are emulated."""

from __future__ import annotations

import pytest

from rig.wire.conversation import Conversation

PATIENCE_S = 500.0  # an emulated clock runs at half the computer's, or less where others work


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that waits for the computer's time answers late, and is not lost."""
    for limit in ("conversation.DEADLINE_S", "conversation.UPLOAD_S", "ports.WRITE_S"):
        monkeypatch.setattr(f"rig.wire.{limit}", PATIENCE_S)
    monkeypatch.setitem(Conversation.hello.__kwdefaults__, "within_s", PATIENCE_S)
