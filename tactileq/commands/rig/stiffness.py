"""tactileq rig stiffness: the virtual wall as stiff as the real surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.options import RigPath
from tactileq.printing import share_of

if TYPE_CHECKING:
    from tactileq.rig.desk.calibration.stiffness import Pressed
    from tactileq.rig.shared.setup.rig_file import RigFile


def rig_stiffness(
    rig: RigPath = Path("rig.toml"),
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Write force against depth as a PNG file.")
    ] = None,
    most_n: Annotated[
        float | None,
        typer.Option("--most", help="Largest force, N; by default 60 % of the device's limit."),
    ] = None,
) -> None:
    """Measure how stiff the real surface is, and the virtual wall that is to feel like it.

    The device presses by itself: let go of the tool when you are asked to. The stiffness is written
    into the rig file, where a study that names none takes it from.

    Example: tactileq rig stiffness --rig rig.toml --picture stiffness.png
    """
    from datetime import date

    from tactileq.analysis.figures.stiffness import figure_stiffness
    from tactileq.analysis.page.saving import DOTS_PER_INCH, save_figure
    from tactileq.rig.desk.calibration.pose import touching_hand
    from tactileq.rig.desk.calibration.stiffness import SHARE, check_virtual, press_on
    from tactileq.rig.desk.walls import largest_of
    from tactileq.rig.shared.live.memory import Live
    from tactileq.rig.shared.setup.figures import Figure
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    with Live.create() as live, touching_hand(loaded, live) as hand:
        assert loaded.force_device is not None  # else there is no such hand
        press_n = SHARE * loaded.force_device.most_n.value if most_n is None else most_n
        if not 0 < press_n <= loaded.force_device.most_n.value:
            raise ValueError(
                f"expected a force up to force.most_n, {loaded.force_device.most_n.value:g} N, got "
                f"{press_n:g} N; lower --most."
            )
        found: list[Pressed] = []
        limit = largest_of(loaded)
        ask("Hold the tool in the air", loaded, on_real=False)
        hand.arm()  # there: on a hard surface it would not give way to the small force after it
        for place in ("Rest the tool on the real surface", "Hold the tool in the air above it"):
            ask(place, loaded, on_real="real" in place)
            wall = found[0].stiffness_n_per_mm if found else None
            if wall is not None and wall > limit:
                print(
                    f"note: the device renders {limit:.3g} N/mm stably, less than the real "
                    f"surface's {wall:.3g} N/mm; the wall is measured with that."
                )
                wall = limit
            with share_of("Pressing") as advance:
                found.append(
                    press_on(
                        live,
                        hand,
                        wall_n_per_mm=wall,
                        most_n=press_n,
                        simulated=loaded.simulated,
                        tick=lambda share: advance(share, ""),
                    )
                )
    real, virtual = found
    assert wall is not None
    for name, one in (("real surface", real), ("virtual wall", virtual)):
        print(
            f"{name}: {one.stiffness_n_per_mm:.3f} N/mm up to {one.force_n.max():.1f} N, friction "
            f"{one.friction_n:.2f} N"
        )
    check_virtual(virtual, commanded_n_per_mm=wall)
    if picture is not None:
        save_figure(figure_stiffness(real, virtual), picture, dpi=DOTS_PER_INCH)
        print(f"force against depth: {picture}")
    source = f"pressed with {press_n:g} N on {date.today()}"
    if loaded.simulated:
        source += ", simulated"
    figure = Figure(round(real.stiffness_n_per_mm, 4), "N/mm", False, source)
    RigFile.updated(loaded.path, {"real_surface.stiffness": figure})
    print(f"real_surface.stiffness: {loaded.path}")


def ask(place: str, rig: RigFile, *, on_real: bool) -> None:
    """Have the tool put there and let go; the stand-in's hand does both by itself."""
    if rig.force_device is not None and rig.force_device.simulated:
        from tactileq.rig.machines.force.standin import StandIn, device_path

        with StandIn(device_path()) as device:
            device.let_go(on_real=on_real)
        return
    typer.prompt(f"{place}, let go, then Enter", default="", show_default=False)
