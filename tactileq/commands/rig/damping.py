"""tactileq rig damping: what a force device's own damping is, on which the stiffest wall rests."""

from __future__ import annotations

from pathlib import Path

from tactileq.options import RigPath
from tactileq.printing import share_of


def rig_damping(rig: RigPath = Path("rig.toml")) -> None:
    """Measure damping and mass of a force device, and the delay of its force.

    The device shakes itself on a soft virtual wall: let go of the tool when you are asked to. The
    least damping that it has (the lower end of a 95 % interval) is written into the rig file, so
    that a wall that is passive by it is passive.

    Example: tactileq rig damping --rig rig.toml
    """
    from datetime import date

    from tactileq.commands.rig.stiffness import ask
    from tactileq.rig.desk.calibration.damping import damping_of, shaken, soft_wall_n_per_mm
    from tactileq.rig.desk.calibration.pose import touching_hand
    from tactileq.rig.desk.walls import largest_of
    from tactileq.rig.shared.live.memory import Live
    from tactileq.rig.shared.setup.figures import Figure
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    with Live.create() as live, touching_hand(loaded, live) as hand:
        assert loaded.force_device is not None  # else there is no such hand
        soft = soft_wall_n_per_mm(largest_of(loaded))
        period_s = 1 / loaded.force_device.rate_hz
        ask("Hold the tool in the air, 5 cm above anything", loaded, on_real=False)
        with share_of("Shaking") as advance:
            runs = shaken(
                live,
                hand,
                stiffness_n_per_mm=soft,
                period_s=period_s,
                tick=lambda share: advance(share, ""),
            )
    found = damping_of(runs, stiffness_n_per_mm=soft, period_s=period_s)
    simulated = ", simulated" if loaded.simulated else ""
    print(f"damping: {found.damping_n_s_per_m} N·s/m; dry friction beside it: {found.dry_n} N")
    print(f"mass: {found.mass_kg} kg")
    print(f"delay from a reading to its force: {found.delay_ms} ms")
    print(f"{found.coherence:.1%} of the motion follow from the commanded force{simulated}")
    source = f"commanded force along z on {date.today()}{simulated}"
    measured = {
        "force.damping": Figure(
            found.least_damping_n_s_per_m,
            "N·s/m",
            False,
            f"least of {found.damping_n_s_per_m}: {source}",
        )
    }
    if found.delay_ms.identified:
        measured["force.delay_ms"] = Figure(
            found.most_delay_ms, "ms", False, f"most of {found.delay_ms}: {source}"
        )
    else:
        print("note: the delay is not known well enough; force.delay_ms stays as it is.")
    changed = RigFile.updated(loaded.path, measured)
    print(
        f"{' and '.join(measured)}: {loaded.path}; walls are passive up to "
        f"{largest_of(changed):.3g} N/mm (before: "
        f"{largest_of(loaded):.3g} N/mm)"
    )
