"""The pictures of docs/force-device.md: `python tools/force_pictures.py`. All of it is simulated.

In real time on this computer, but for the periods that differ, which are drawn.
"""

from __future__ import annotations

import os
import tempfile
from math import nan
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.process import limits_of
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.standin import PLACE, StandIn
from tactileq.rig.machines.force.states import Ask, Cause, ForceEvent, State
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import Live

DOCS = Path(__file__).parents[1] / "docs" / "force-device"
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#7f7f7f"
SETTINGS = ForceSettings(library="stand-in", late_s=0.015, simulated=True, watched=False)
WALL = Wall(stiffness_n_per_mm=0.6, width_mm=100, length_mm=100)


def watched(
    device: StandIn, live: Live, hand: ForceHand, seconds: float
) -> list[tuple[float, ...]]:
    """Time, command along z, what the motors give, true height, state; every millisecond."""
    lib, rows, end_s = compiled().lib, [], now_s() + seconds
    while now_s() < end_s:
        live.heartbeat()
        at_s = now_s()
        command = lib.tq_figure(live.address, lib.TQ_WORD_FORCE + 2)
        rows.append(
            (
                at_s,
                command,
                device.force_n(at_s)[2],
                1e3 * device.fields.position[2],
            )
        )
        sleep(0.001)
    return rows


def latch(device: StandIn) -> None:
    """A hiccup of 50 ms, upon which the device's own watchdog switches its forces off."""
    device.reset()
    device.fields.has_watchdog = 1
    device.fields.began_s -= 2
    device.fields.position[2] = -0.005
    with Live.create() as live, ForceHand(live, HandSettings(kind="force"), SETTINGS) as hand:
        hand.arm()
        hand.show(WALL)
        watched(device, live, hand, 0.6)
        rows = watched(device, live, hand, 0.2)
        device.fields.stall_s = 0.05
        stall_s = now_s()
        rows += watched(device, live, hand, 0.4)
        cause = hand.status.cause
        hand.arm()
        hand.show(WALL)
        armed_s = now_s()
        rows += watched(device, live, hand, 0.5)
    time_s, command, given, _ = np.array(rows).T
    figure, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
    axes.plot(1e3 * (time_s - stall_s), command, color=ORANGE, lw=3, label="commanded")
    axes.plot(1e3 * (time_s - stall_s), given, color=BLUE, label="given by the motors")
    for at_s, text in (
        (stall_s, f"hiccup of 50 ms:\nfault {cause.name}"),
        (armed_s, "enabled, armed,\nshown: a ramp"),
    ):
        axes.axvline(1e3 * (at_s - stall_s), color=GREY, ls=":")
        axes.annotate(text, (1e3 * (at_s - stall_s) + 100, 0.2))
    axes.set(
        xlabel="time, ms",
        ylabel="force along z, N",
        title="Forces that a device switched off (stand-in, simulated)",
    )
    axes.legend(loc="lower right")
    save(figure, "latch")


def swing(
    bound_periods: float, *, mean: bool, most_ms: float, seconds: float
) -> tuple[Any, Any, Cause]:
    """Height of 0.2 kg on a wall of 0.8 of the bound for so many nominal periods."""
    module = compiled()
    ffi, lib = module.ffi, module.lib
    period_s, b, kg, weight, rng = 1e-3, 5e-4, 2e-4, 1.0, np.random.default_rng(1)
    limits = limits_of(ForceSettings(frozen_s=5.0, show_s=1e-9))
    limits.period_s = period_s if mean else 0
    force, sensed = ffi.new("tq_force *"), ffi.new("tq_sensed *")
    lib.tq_force_start(force, limits)
    stiffness = 0.8 * b / (bound_periods * period_s / 2)
    lib.tq_force_set_wall(force, ffi.new("tq_wall *", (0, stiffness, 0, 100, 100)))
    sensed.position_mm = [0, 0, 1]
    lib.tq_force_tick(force, sensed, period_s)
    lib.tq_force_event(force, ForceEvent.ARM, 0)
    lib.tq_force_event(force, ForceEvent.SHOW, 0)
    force.sensed = 0
    rest = z = -weight / stiffness
    v, t, step_s, h = 1.0, 0.0, period_s, 5e-5
    times, heights = [], []
    while t < seconds:
        sensed.position_mm = [0, 0, z]
        lib.tq_force_tick(force, sensed, step_s)
        times.append(t)
        heights.append(z - rest if force.cause == 0 else nan)
        step_s = 1e-3 * rng.uniform(1.0, most_ms)
        for _ in range(round(step_s / h)):
            v += (force.normal_n - weight - b * v) / kg * h
            z += v * h
            t += h
    return np.array(times), np.array(heights), Cause(force.cause)


def jitter() -> None:
    """Periods of 1 to 4 ms on the bound of the nominal period, and on that of the tolerated one."""
    figure, axes = plt.subplots(2, 1, figsize=(8, 4.6), layout="constrained")
    time_s, height, _ = swing(1, mean=False, most_ms=4.0, seconds=6.0)
    axes[0].plot(time_s, height, color=ORANGE)
    axes[0].set_title("Bound of the nominal period, no look at the mean: 1 to 4 ms")
    for most_ms, color in ((2.0, BLUE), (4.0, ORANGE)):
        time_s, height, cause = swing(2, mean=True, most_ms=most_ms, seconds=1.5)
        axes[1].plot(time_s, height, color=color, label=f"1 to {most_ms:g} ms")
        if cause:
            last = np.flatnonzero(~np.isnan(height))[-1]
            axes[1].plot(time_s[last], height[last], "o", color=color)
            axes[1].annotate(
                f"let go after {1e3 * time_s[last]:.0f} ms: {cause.name}",
                (time_s[last], height[last]),
                xytext=(12, 12),
                textcoords="offset points",
            )
    axes[1].set_title("Bound of twice the nominal period, let go where their mean is longer")
    axes[1].set_xlabel("time, s")
    axes[1].legend(loc="lower right")
    for one in axes:
        one.set_ylabel("swing, mm")
    figure.suptitle("0.2 kg on a wall at 0.8 of the bound (simulated)")
    save(figure, "jitter")


def flipped(device: StandIn) -> None:
    """The small force after arming, and what the encoders say of it."""
    figure, axes = plt.subplots(3, 1, figsize=(8, 5), layout="constrained", sharex=True)
    settings = ForceSettings(**{**vars(SETTINGS), "probe_n": 1.0, "answer_s": 0.001})
    for wrong, row, color in ((0, 1, BLUE), (1, 2, ORANGE)):
        device.reset()
        device.fields.began_s -= 2
        device.fields.press = -0.02  # the hand holds it in the air
        device.fields.position[2] = 0.02
        device.fields.flipped = wrong
        with Live.create() as live, ForceHand(live, HandSettings(kind="force"), settings) as hand:
            sleep(0.8)
            hand.control.ask(Ask.ARM)
            rows = watched(device, live, hand, 0.6)
            status = hand.status
        time_s, command, _, height = np.array(rows).T
        said = -height if wrong else height
        ms = 1e3 * (time_s - time_s[0])
        axes[0].plot(ms, command, color=GREY)
        axes[row].plot(ms, said - said[0], color=color)
        told = "armed" if status.state == State.ARMED else f"let go: {status.cause.name}"
        axes[row].set_title(f"encoders that count {'backwards' if wrong else 'right'}: {told}")
        axes[row].set_ylabel("reported, mm")
    axes[0].set(
        ylabel="force, N", title="The small force after arming (stand-in in a hand, simulated)"
    )
    axes[2].set_xlabel("time, ms")
    save(figure, "flipped")


def save(figure: Any, name: str) -> None:
    """Into docs/force-device/."""
    DOCS.mkdir(exist_ok=True)
    figure.savefig(DOCS / f"{name}.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ[PLACE] = str(Path(folder) / "device")
        with StandIn(Path(folder) / "device") as one:
            latch(one)
            flipped(one)
    jitter()
