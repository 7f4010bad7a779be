"""Emulated boards: what their ports can do; what runs on them is tested with each machine."""

from __future__ import annotations

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.emulating import KINDS, Kind, check_baud
from tests.refusals import refused


@pytest.mark.parametrize(
    ("kind", "baud"), [("m7", 9000), ("m7", 1_515_000), ("stm32", 6_000_000), ("stm32", 0)]
)
def test_a_baud_rate_that_the_board_cannot_have_is_refused(kind: Kind, baud: int) -> None:
    with refused(InputError, expected="baud", got=baud):
        check_baud(kind, baud)


def test_usual_baud_rates_are_taken() -> None:
    for kind in KINDS:
        for baud in (115_200, 500_000):
            check_baud(kind, baud)
