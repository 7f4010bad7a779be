"""The parts of a desk rig, as its file says."""

from __future__ import annotations

from tactileq.rig.desk.parts import sound_output
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, RigFile


def test_the_shipped_rig_can_play_all_that_its_limits_allow() -> None:
    shipped = RigFile.load(SHIPPED_RIG_FILE)
    assert shipped.limits.peak_g.value * shipped.fullscale_per_g <= 1
    with Live.create() as live:
        assert sound_output(shipped, live).misses == 0  # limits beyond full scale are refused
