"""A device that renders by itself as the hand of a rig, and as what it may be asked to play."""

from __future__ import annotations

import queue
import threading
from typing import Any

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import Report
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.device.messages import DeviceAnswer, DeviceRequest, Wanted
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.shared.live.child import ChildLost
from tactileq.rig.shared.live.clock import holding, next_of, now_s
from tactileq.rig.shared.live.memory import Live

ANSWER_S = 20.0  # an upload through a slow port
_LOOK_S = 0.02


class DeviceHand(ForceHand):
    """As `ForceHand`, of a device at the address that `force` holds."""

    process = "tactileq.rig.machines.device.servo"
    reports = Report | DeviceAnswer

    def __init__(self, live: Live, settings: HandSettings, force: ForceSettings) -> None:
        super().__init__(live, settings, force)
        self._asking = threading.Lock()
        self._answers: queue.Queue[DeviceAnswer] = queue.Queue()
        self._number = 0

    def ask(self, wanted: Wanted, *, within_s: float = ANSWER_S) -> DeviceAnswer:
        """Have the device do something; a heartbeat while it does.

        Raises
        ------
        InputError
            If it refuses, and why.
        ChildLost
            If the process that talks to it ends, or does not answer.
        """
        with holding(self._asking):
            child = self._child
            if child is None:
                raise ChildLost("it is not open")
            self._number += 1
            child.send(DeviceRequest(self._number, wanted))
            end_s = now_s() + within_s
            while now_s() < end_s and child.runs:
                self._live.heartbeat()
                for answer in next_of(self._answers, _LOOK_S):
                    if answer.number != self._number:
                        continue
                    if answer.lost:
                        raise ChildLost("no device at its end")
                    if answer.sentence:
                        raise InputError(answer.sentence)
                    return answer
            raise ChildLost("it does not answer" if child.runs else "it has ended")

    def _take(self, report: Any) -> None:
        self._answers.put(report)
