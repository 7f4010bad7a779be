"""A simulated force device of a test's own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tactileq.rig.machines.force.standin import StandIn
from tests.rig.machines.force.rig_files import standing_in


@pytest.fixture
def device(given_clock: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    with standing_in(tmp_path, monkeypatch) as made:
        yield made
