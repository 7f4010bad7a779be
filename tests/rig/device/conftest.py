"""An emulated device of its own for each test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rig.device.emulating import Emulator


@pytest.fixture
def device(given_clock: None) -> Iterator[Emulator]:
    with Emulator("process") as emulator:
        yield emulator
