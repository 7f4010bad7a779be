"""A hand in a process of its own: writes readings to the memory of this PATH until it is killed."""

from __future__ import annotations

import sys

from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.memory import CONTACT, Live

live = Live.attach(sys.argv[1])
with taking_part():
    while True:
        live.write_reading(now_s(), 0.0, y_mm=0.0, speed_mm_s=200.0, force_n=1.5, flags=CONTACT)
        sleep(0.002)
