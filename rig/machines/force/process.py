"""The servo's process, driven by `tactileq.rig.machines.force.messages`.

Python opens the device and hands it to `tq_servo_run` (rig/machines/force/servo.h), which keeps
this thread until it is asked to stop. Where the parent is gone, the force ramps to 0 and the
process ends (docs/force-device.md#processes).
"""

from __future__ import annotations

import gc
import threading
from math import nan
from typing import Any

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import Ready
from tactileq.rig.machines.force.dhd import DhdLibrary
from tactileq.rig.machines.force.realtime import SERVO_PRIORITY, real_time
from tactileq.rig.machines.force.serving import ServedServo, serve_servo
from tactileq.rig.machines.force.settings import (
    JUMP_MM,
    MISSED_S,
    UNWATCHED_S,
    VELOCITY_HZ,
    ForceSettings,
)
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import GONE, HEARTBEAT_S, SIMULATED, Live


def main() -> None:
    """Run the servo until the parent is gone."""
    serve_servo(_Servo)


class _Servo(ServedServo):
    def __init__(
        self, parent: Parent, live: Live, settings: ForceSettings, gone: threading.Event
    ) -> None:
        super().__init__(parent, live, settings, gone)
        self._library = DhdLibrary(settings.library)

    def _run_once(self) -> None:
        number = self._library.find(self._settings.serial)
        with self._library.opened(number) as name:
            guarded = self._library.set_watchdog(number, seconds=MISSED_S)
            device = self._library.device(number)
            backend = compiled().lib.tq_dhd_backend(device)
            servo, _kept = prepared(self._live, backend, self._settings)
            own = "its own watchdog" if guarded else "no watchdog of its own"
            self._told = ""
            real = real_time(SERVO_PRIORITY)
            self._parent.send(
                Ready(f"{name}, {own}, {'real-time' if real else 'ordinary'} priority")
            )
            gc.collect()
            gc.freeze()
            if not self._gone.is_set():
                compiled().lib.tq_servo_run(servo)
        if not self._gone.is_set():
            raise InputError(
                "expected the force device to go on, got none; check its cable and power."
            )

    def _write_gone(self) -> None:
        flags = GONE | (SIMULATED if self._settings.simulated else 0)
        self._live.write_reading(now_s(), nan, y_mm=nan, speed_mm_s=0.0, force_n=0.0, flags=flags)


def prepared(live: Live, backend: Any, settings: ForceSettings) -> tuple[Any, Any]:
    """A `tq_servo` that begins without force, and its memory, which has to be kept."""
    module = compiled()
    ffi, lib = module.ffi, module.lib
    own = ffi.new(
        "tq_servo_settings *",
        {
            "period_s": 1 / settings.rate_hz,
            "delay_s": settings.delay_s,
            "contact_n": settings.contact_n,
            "heartbeat_s": HEARTBEAT_S,
            "sound_s": settings.sound_s,
            "watchdog_s": UNWATCHED_S if settings.watched else 0.0,
            "simulated": settings.simulated,
        },
    )
    memory = ffi.new("char[]", lib.tq_servo_size())
    servo = ffi.cast("tq_servo *", memory)
    lib.tq_servo_start(servo, live.address, backend, own, limits_of(settings))
    return servo, memory


def limits_of(settings: ForceSettings) -> Any:
    """The same limits as a `tq_force_limits`."""
    pose = settings.pose
    return compiled().ffi.new(
        "tq_force_limits *",
        {
            **{
                name: getattr(settings, name)
                for name in ("late_s", "frozen_s", "release_s", "show_s", "most_n", "most_n_per_s")
            },
            "period_s": 1 / settings.rate_hz,
            "probe_n": settings.probe_n,
            "answer_s": settings.answer_s,
            "most_w": settings.most_w,
            "most_mm_s": settings.most_mm_s,
            "jump_mm": JUMP_MM,
            "velocity_hz": VELOCITY_HZ,
            "low_mm": settings.low_mm,
            "high_mm": settings.high_mm,
            "origin_mm": pose.origin_mm,
            "axes": (*pose.x, *pose.y, *pose.z),
        },
    )


if __name__ == "__main__":
    main()
