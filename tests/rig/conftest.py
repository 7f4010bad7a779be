"""Patience with chips that are emulated."""

from __future__ import annotations

import pytest

PATIENCE_S = 500.0  # an emulated clock runs at half the computer's, or less where others work


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that waits for the computer's time answers late, and is not lost."""
    for limit in ("HELLO_S", "DEADLINE_S", "UPLOAD_S"):
        monkeypatch.setattr(f"tactileq.rig.shared.wire.conversation.{limit}", PATIENCE_S)
    monkeypatch.setattr("tactileq.rig.shared.wire.ports.WRITE_S", PATIENCE_S)
