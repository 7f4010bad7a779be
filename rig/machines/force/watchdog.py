"""The watchdog's process, driven by `tactileq.rig.machines.force.messages`.

A servo that was stopped cannot end its own force. Where one that may push has not ticked for 20 ms,
it is killed, and the device opened and released in its place. Nothing is armed again
(docs/force-device.md#watchdog).
"""

from __future__ import annotations

import os
import signal
import threading
from contextlib import suppress

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import Ready
from tactileq.rig.machines.force.control import Control
from tactileq.rig.machines.force.dhd import DhdLibrary
from tactileq.rig.machines.force.messages import Acted, Servo, Watch
from tactileq.rig.machines.force.realtime import WATCHDOG_PRIORITY, outlive_signals, real_time
from tactileq.rig.machines.force.settings import MISSED_S, ForceSettings
from tactileq.rig.machines.force.states import State
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.live.messages import Done

LOOK_S = 0.05
EVERY_S = 0.002
OPEN_S = 1.0  # a device may take a while to be free
ORPHANED_S = 2.0  # after which a servo whose parent is gone, too, is ended
_PUSHES = (State.ARMED, State.RUNNING, State.RELEASING)


def main() -> None:
    """Watch until the parent is gone and the servo has let go."""
    with Parent() as parent:
        outlive_signals()
        wanted = parent.settings(Watch)
        library = DhdLibrary(wanted.settings.library)  # now: later there is no time
        with Live.attach(wanted.live) as live:
            dog = _Watchdog(parent, live, library, wanted.settings)
            threading.Thread(target=dog.listen, daemon=True).start()
            real_time(WATCHDOG_PRIORITY)
            parent.send(Ready("watchdog"))
            with taking_part():
                dog.run()


class _Watchdog:
    def __init__(
        self, parent: Parent, live: Live, library: DhdLibrary, settings: ForceSettings
    ) -> None:
        self._parent, self._library, self._settings = parent, library, settings
        self._control = Control(live)
        self._servo, self._told_s = 0, 0.0
        self._gone_s = float("inf")

    def listen(self) -> None:
        """Take over who has the device, until the parent is gone."""

        def take(servo: Servo) -> Done:
            self._servo, self._told_s = servo.pid, now_s()
            return Done()

        with suppress(OSError):
            self._parent.serve(Servo, take)
        self._gone_s = now_s()

    def run(self) -> None:
        """Look again and again."""
        while True:
            servo = self._servo
            missed = self._control.missed(
                LOOK_S, missed_s=MISSED_S, since_s=self._told_s, every_s=EVERY_S
            )
            pushes = self._control.status.state in _PUSHES and bool(servo)
            if servo and (missed or (pushes and now_s() > self._gone_s + ORPHANED_S)):
                self._act(servo)
            if now_s() > self._gone_s and not pushes:
                return

    def _act(self, servo: int) -> None:
        """End the servo, and its force."""
        ticked_s, sentence = self._control.tick_s, ""
        with suppress(ProcessLookupError):
            os.kill(servo, getattr(signal, "SIGKILL", signal.SIGTERM))
        until_s = now_s() + OPEN_S
        while True:
            try:
                with self._library.opened(self._library.find(self._settings.serial), homed=False):
                    sentence = ""
                break
            except InputError as error:
                sentence = str(error)
            if now_s() > until_s:
                break
            sleep(EVERY_S)
        self._servo = 0
        self._control.stood_still()
        with suppress(OSError):
            self._parent.send(Acted(servo, now_s() - ticked_s, sentence))


if __name__ == "__main__":
    main()
