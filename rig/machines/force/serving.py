"""How the process of a servo begins and ends: driven by `tactileq.rig.machines.force.messages`."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import Any

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import HandFault
from tactileq.rig.machines.force.control import Control
from tactileq.rig.machines.force.messages import RunServo
from tactileq.rig.machines.force.realtime import outlive_signals
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.states import Ask
from tactileq.rig.shared.live.clock import now_s, wait_for
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.live.messages import Done, Message

AGAIN_S = 0.5  # between attempts to open a device that is gone
_BEAT_S = 0.02


class ServedServo(ABC):
    """A servo, and what its process does for it.

    Parameters
    ----------
    parent : Parent
        Is told what the device is, and of faults.
    gone : threading.Event
        Set once the parent is gone.
    """

    requests: Any = Done  # what the parent may ask for; a union

    def __init__(
        self, parent: Parent, live: Live, settings: ForceSettings, gone: threading.Event
    ) -> None:
        self._parent, self._live, self._settings, self._gone = parent, live, settings, gone
        self._told = ""

    def run(self, *, patient: bool) -> None:
        """Until the parent is gone and there is no force; never armed anew by itself.

        A device that is not there is waited for where it is patient, and one that is lost always.
        """
        while not self._gone.is_set():
            try:
                self._run_once()
            except InputError as error:
                if not patient:
                    raise
                self._tell(str(error))
                self._wait()
            patient = True
        self._write_gone()

    @abstractmethod
    def _run_once(self) -> None:
        """With a device until it or the parent is gone; InputError where the device is."""

    @abstractmethod
    def _write_gone(self) -> None:
        """Write a reading that says that there is no device."""

    def answer(self, request: Any) -> Message:
        """Do what the parent asks for, in a thread of its own."""
        assert isinstance(request, Done)
        return request

    def _tell(self, sentence: str) -> None:
        """Report a fault, unless it was the last one."""
        if sentence != self._told:
            self._told = sentence
            self._parent.send(HandFault(sentence))

    def _wait(self) -> None:
        """Until the next attempt; the readings go on, and say that there is no device."""
        until_s = now_s() + AGAIN_S
        while now_s() < until_s and not wait_for(self._gone.wait, _BEAT_S):
            self._write_gone()


def serve_servo(kind: type[ServedServo]) -> None:
    """Run a servo of this kind until the parent is gone; then it is asked to stop."""
    with Parent() as parent:
        outlive_signals()
        wanted = parent.settings(RunServo)
        with Live.attach(wanted.live) as live:
            gone = threading.Event()
            servo = kind(parent, live, wanted.settings, gone)
            threading.Thread(target=_listen, args=(parent, live, gone, servo), daemon=True).start()
            servo.run(patient=wanted.patient)


def _listen(parent: Parent, live: Live, gone: threading.Event, servo: ServedServo) -> None:
    """Answer the parent, and have the servo stop once it is gone."""
    with suppress(OSError):
        parent.serve(servo.requests, servo.answer)
    gone.set()
    with suppress(TypeError):  # the memory is released already
        Control(live).ask(Ask.STOP, within_s=0)
