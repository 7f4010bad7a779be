"""A force device as the hand of a rig: servo, watchdog and wall (docs/force-device.md)."""

from __future__ import annotations

import threading
from contextlib import suppress

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import Ready
from tactileq.rig.devices.hand.reader import SILENT_S, START_S, HandReader
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.force.control import Control
from tactileq.rig.machines.force.messages import Acted, RunServo, Servo, Watch
from tactileq.rig.machines.force.settings import UNWATCHED_S, ForceSettings
from tactileq.rig.machines.force.states import Ask, Cause, State, Status
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.child import Child, ChildLost
from tactileq.rig.shared.live.clock import check_clock, now_s, sleep
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.live.messages import Done

PROBE_S = 0.45  # of the small force after arming, TQ_PROBE_S of force.h, and what follows it
ENABLING_S = 0.03  # for a device to say that its forces are on
START_ANEW_S = 2.0  # for a process that takes the place of another one
_LOOK_S = 0.002


class ForceHand(HandReader):
    """Readings of a force device in shared memory, and a wall that it renders, while this is open.

    It begins without force. `arm` is asked for by people only: at the beginning, and after a fault
    once its cause is gone.

    Parameters
    ----------
    live : Live
        Has to outlive this.
    settings : HandSettings
        Of kind "force".
    force : ForceSettings
    """

    process = "tactileq.rig.machines.force.process"  # of the servo

    def __init__(self, live: Live, settings: HandSettings, force: ForceSettings) -> None:
        force.check_late()
        check_clock("a force device", simulated=force.simulated)
        super().__init__(live, settings)
        self._force = force
        self._control = Control(live)
        self._watchdog: Child | None = None
        self._watched_s = float("inf")  # since when a watchdog has to look
        self._reported: Status | None = None  # of the last fault that was told

    def open(self) -> None:
        """Start servo and watchdog; returns once the device is open, without force.

        Raises
        ------
        InputError
            If the library or the device is not there, or cannot be used.
        """
        if self._force.watched:
            self._start_watchdog()
        try:
            super().open()
        except BaseException:
            self._end_watchdog()
            raise

    def close(self) -> None:
        """Ramp the force to 0 and end; the last reading says that the device is gone."""
        super().close()
        self._end_watchdog()

    @property
    def status(self) -> Status:
        """State of the servo; a fault where its process is gone."""
        return self._control.status

    @property
    def watchdog_pid(self) -> int | None:
        """Number of the watchdog's process; None where there is none."""
        return self._watchdog.pid if self._watchdog is not None else None

    @property
    def control(self) -> Control:
        """What servo and host share."""
        return self._control

    def arm(self) -> None:
        """Allow force, after a fault if its cause is gone; the wall stays hidden.

        Raises
        ------
        InputError
            If the device has a fault still, and which.
        """
        until_s = now_s() + START_ANEW_S
        while self.status.state == State.RELEASING and now_s() < until_s:
            sleep(_LOOK_S)
        if self.status.state == State.FAULT:
            self._control.ask(Ask.CLEAR)
        while self._begins and now_s() < until_s:
            sleep(_LOOK_S)
        if self.status.state == State.IDLE:
            self._control.ask(Ask.ARM)
            sleep(ENABLING_S + (PROBE_S if self._force.probe_n > 0 else 0.0))
        status = self.status
        if status.state not in (State.ARMED, State.RUNNING):
            raise InputError(
                status.sentence
                or "expected a force device that can be armed, got one that says nothing; see "
                "whether it is connected."
            )
        self._reported = None

    @property
    def _begins(self) -> bool:
        """Whether the servo, or a watchdog in place of another one, is not yet at work."""
        unwatched = self._force.watched and now_s() - self._control.watched_s > UNWATCHED_S
        return unwatched or self.status.state in (State.BOOT, State.RELEASING)

    def show(self, wall: Wall) -> None:
        """Render this wall; where it is penetrated already, it comes as a ramp.

        Raises
        ------
        InputError
            If the device is not armed, and why.
        """
        self._control.set_wall(wall)
        status = self._control.ask(Ask.SHOW)
        if status.state != State.RUNNING:
            self._reported = status
            raise InputError(
                status.sentence
                or "expected an armed force device, got one without force; confirm on the "
                "experimenter's screen that it may push."
            )

    def hide(self) -> None:
        """Ramp the wall out."""
        if self.status.state == State.RUNNING:
            self._control.ask(Ask.HIDE)

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each."""
        dog, status = self._watchdog, self.status
        if dog is not None and now_s() - max(self._watched_s, self._control.watched_s) > SILENT_S:
            self._watched_s = now_s()
            dog.kill()  # suspended: another one takes its place
        if status.state in (State.FAULT, State.RELEASING) and self._reported is None:
            self._reported = status
            if status.cause != Cause.STOPPED:
                self._add_fault(status.sentence)
        return super().faults()

    def _start(self, *, patient: bool) -> Child:
        settings = RunServo(live=str(self._live.path), settings=self._force, patient=patient)
        self._child = child = Child(self.process, settings)
        if self._watchdog is not None:
            with suppress(ChildLost):
                self._watchdog.send(Servo(child.pid))
        if self._closing.is_set():  # closed in between
            child.close()
        return child

    def _start_watchdog(self) -> None:
        self._watchdog = dog = Child(
            "tactileq.rig.machines.force.watchdog",
            Watch(live=str(self._live.path), settings=self._force),
        )
        try:
            dog.ready(Ready, within_s=START_S)
        except ChildLost as lost:
            raise InputError(
                f"expected the watchdog of the force device to start, got: {lost}; close other "
                "programs and try again."
            ) from None
        if self._child is not None and self._child.runs:
            dog.send(Servo(self._child.pid))
        self._watched_s = now_s()
        threading.Thread(target=self._hear, args=(dog,), daemon=True).start()

    def _hear(self, dog: Child) -> None:
        """Report what the watchdog did; put another in its place where it ends."""
        with suppress(ChildLost, InputError):
            while True:
                heard = dog.hear(Acted | Done)
                if isinstance(heard, Acted):
                    self._add_fault(
                        f"the servo of the force device stood still and was killed, "
                        f"{1e3 * heard.seconds:.0f} ms after its last tick"
                        + (f"; {heard.sentence}" if heard.sentence else ".")
                    )
        how = dog.end()
        if self._closing.is_set() or dog is not self._watchdog:
            return
        self._add_fault(f"the watchdog of the force device ended {how} and is started again.")
        with suppress(InputError):
            self._start_watchdog()

    def _end_watchdog(self) -> None:
        dog, self._watchdog = self._watchdog, None
        if dog is not None:
            dog.close()
