"""tactileq rig pose: where the wall of a force device lies."""

from __future__ import annotations

from pathlib import Path

import typer

from tactileq.options import RigPath

POINTS = (
    "Touch the first point of the surface: the middle of the wall",
    "Touch a second point, to its right: the direction of x",
    "Touch a third point of the surface, away from the line through both",
)


def rig_pose(rig: RigPath = Path("rig.toml")) -> None:
    """Measure where the surface lies for a force device, by touching three points of it.

    The device is never armed meanwhile. Lift the tool from point to point: the wall faces the side
    from which you touch. The result is written as [pose] into the rig file; measure it again
    whenever the device was homed or moved.

    Example: tactileq rig pose --rig rig.toml
    """
    from datetime import date

    from tactileq.rig.desk.calibration.pose import Touched, pose_of, touched, touching_hand
    from tactileq.rig.shared.live.memory import Live
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    with Live.create() as live, touching_hand(loaded, live):
        found: list[Touched] = []
        since = live.readings_written
        for point in POINTS:
            typer.prompt(f"{point}; hold still, then Enter", default="", show_default=False)
            since, one = touched(live, since)
            x, y, z = one.point_mm
            print(f"  {x:.1f}, {y:.1f}, {z:.1f} mm in the device's frame")
            found.append(one)
    first, second, third = found
    pose = pose_of((first, second, third), today=date.today())
    keys = {
        "pose.origin_mm": list(pose.origin_mm),
        "pose.x": list(pose.x),
        "pose.z": list(pose.z),
        "pose.measured_on": pose.measured_on,
    }
    RigFile.updated(loaded.path, keys)
    print(f"{', '.join(keys)}: {loaded.path}")
