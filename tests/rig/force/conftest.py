"""A simulated force device of a test's own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.force.standin import StandIn


@pytest.fixture
def device(given_clock: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    """The stand-in's device, which the processes of this test open."""
    path = tmp_path / "device"
    monkeypatch.setenv("TACTILEQ_STANDIN", str(path))
    with StandIn(path) as made:
        made.fields.began_s -= 2  # its hand has come down already
        yield made
