"""tactileq rig: checks, measurements and playback on a rig, outside of experiments."""

from __future__ import annotations

import typer

from tactileq.commands.rig.calibrate import rig_calibrate
from tactileq.commands.rig.check import rig_check
from tactileq.commands.rig.damping import rig_damping
from tactileq.commands.rig.device import rig_device
from tactileq.commands.rig.latency import rig_latency
from tactileq.commands.rig.monitor import rig_monitor
from tactileq.commands.rig.play import rig_play
from tactileq.commands.rig.pose import rig_pose
from tactileq.commands.rig.range import rig_range
from tactileq.commands.rig.stiffness import rig_stiffness
from tactileq.commands.rig.twin import rig_twin

rig = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="A rig for real hands: its parts, state, calibration and latency.",
)
rig.command("check")(rig_check)
rig.command("monitor")(rig_monitor)
rig.command("calibrate")(rig_calibrate)
rig.command("latency")(rig_latency)
rig.command("range")(rig_range)
rig.command("pose")(rig_pose)
rig.command("damping")(rig_damping)
rig.command("stiffness")(rig_stiffness)
rig.command("play")(rig_play)
rig.command("twin")(rig_twin)
rig.command("device")(rig_device)
