"""A session that shows a wall under a planted texture and looks after it: `host.py RIG_FILE`.

It says which processes it has, then waits to be killed or stopped.
"""

from __future__ import annotations

import json
import sys

from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.shared.live.clock import sleep, taking_part
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.textures import planted_texture

model = planted_texture("PVC")
with DeskRig(RigFile.load(sys.argv[1]), override="a test") as rig, taking_part():
    rig.arm()
    rig.present_model(model)
    reader, sound = rig.parts.reader, rig.parts.sound
    assert isinstance(reader, ForceHand)
    told = {
        "servo": reader.pid,
        "watchdog": reader.watchdog_pid,
        "sound": sound.pid,
        "live": str(rig.parts.live.path),
    }
    print(json.dumps(told), flush=True)
    while True:
        sleep(0.02)
        rig.read()
        for fault in rig.take_faults():
            print(fault.sentence, file=sys.stderr, flush=True)
