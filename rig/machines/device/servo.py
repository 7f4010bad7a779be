"""The process of a device that renders by itself, in the place of a servo.

It is driven by `tactileq.rig.machines.force.messages` and speaks to the other processes of a rig as
the servo of a force device does (rig/machines/force/servo.h): what they ask for goes over the wire,
and records come back as readings of the hand. The law runs in the device (docs/device.md#in-a-rig).
"""

from __future__ import annotations

import threading
from contextlib import suppress

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.messages import Firmware, Ready
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.messages import DeviceAnswer, DeviceRequest
from tactileq.rig.machines.device.registers import DeviceCommand, DeviceFlags, DeviceStatus
from tactileq.rig.machines.device.rendering import DevicePlayer
from tactileq.rig.machines.force.realtime import SERVO_PRIORITY, real_time
from tactileq.rig.machines.force.serving import ServedServo, serve_servo
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.states import Ask, Cause, State
from tactileq.rig.machines.force.words import ServoWords
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import (
    BEYOND,
    BUTTON,
    CONTACT,
    FORCE_COMMANDED,
    SIMULATED,
    Live,
)
from tactileq.rig.shared.setup.rig_file import DEVICE_RATE_HZ
from tactileq.rig.shared.wire.conversation import Block, DeviceRefused
from tactileq.rig.shared.wire.link import Link
from tactileq.rig.shared.wire.transports import opened_transport

RECORDS_HZ = 1000
TURN_S = 0.001
LOOK_S = 0.01  # between looks at the device's state
_ASKED = {
    Ask.ARM: DeviceCommand.ARM,
    Ask.SHOW: DeviceCommand.SHOW,
    Ask.HIDE: DeviceCommand.HIDE,
    Ask.CLEAR: DeviceCommand.CLEAR,
    Ask.STOP: DeviceCommand.STOP,
}
_FLAGS = {
    DeviceFlags.CONTACT: CONTACT,
    DeviceFlags.BUTTON: BUTTON,
    DeviceFlags.BEYOND: BEYOND,
    DeviceFlags.SIMULATED: SIMULATED,
}


def main() -> None:
    """Pass on what is asked and read until the parent is gone."""
    serve_servo(DeviceServo)


class DeviceServo(ServedServo):
    """The device between shared memory and wire; parameters as `ServedServo`."""

    requests = DeviceRequest

    def __init__(
        self, parent: Parent, live: Live, settings: ForceSettings, gone: threading.Event
    ) -> None:
        super().__init__(parent, live, settings, gone)
        self._words = ServoWords(live)
        self._link = Link(lambda: opened_transport(settings.address, settings.baud), DEVICE)
        self._state, self._cause = State.BOOT, Cause.NONE
        self._simulated = settings.simulated
        self._beat_s = self._looked_s = self._played_s = self._reading_s = 0.0
        self._blocks = 0
        self._ready = self._real_time = False
        self._player = None
        if settings.vibration is not None:
            self._player = DevicePlayer(self._link, live, settings.vibration)

    def answer(self, request: DeviceRequest) -> DeviceAnswer:
        """Have the device play, or say what it played."""
        if self._player is None:
            return DeviceAnswer(number=request.number, sentence="the device plays nothing here.")
        return self._player.answer(request)

    def _run_once(self) -> None:
        self._real_time = real_time(SERVO_PRIORITY)  # the thread of the link inherits it
        with self._link, taking_part():
            self._ready = False
            while not self._gone.is_set():
                self._turn()
            self._let_go()

    def _turn(self) -> None:
        began_s = now_s()
        for sentence in self._link.faults():
            self._ready = False
            self._tell(sentence)
        if not self._link.connected:
            self._report(State.FAULT, Cause.LINK)
            self._write_gone()
            if self._player is not None:
                self._player.gone()
        else:
            try:
                if not self._ready:
                    self._prepare()
                self._obey()
                self._mind(began_s)
                self._look(began_s)
            except InputError:
                if self._link.connected:
                    raise
        self._pass_on(self._link.blocks())
        sleep(max(0.0, TURN_S - (now_s() - began_s)))

    def _prepare(self) -> None:
        """Set the limits of a device that is here anew; the narrower workspace counts."""
        link, settings = self._link, self._settings
        self._simulated = bool(link.read("Simulated"))
        if self._simulated and not settings.simulated:
            raise InputError(
                "expected a board with a hand at [device], got an emulated one; set "
                "device.simulated = true, so that data say so."
            )
        if link.read("State") not in (State.BOOT, State.IDLE, State.FAULT):
            link.write("Command", DeviceCommand.STOP)
            sleep(0.05)
        low_x, high_x, low_z, high_z = link.read("Workspace")  # type: ignore[misc]
        (x0, _, z0), (x1, _, z1) = settings.low_mm, settings.high_mm
        link.write("Workspace", (max(x0, low_x), min(x1, high_x), max(z0, low_z), min(z1, high_z)))
        link.write("ForceLimit", settings.most_n)
        link.write("ForceSlew", settings.most_n_per_s)
        link.write("PowerLimit", settings.most_w)
        link.write("SpeedLimit", settings.most_mm_s)
        link.write("ContactForce", settings.contact_n)
        link.write("FrozenTime", settings.frozen_s)
        link.write("ReleaseTime", settings.release_s)
        link.write("SpeedDelay", round(1e3 * settings.delay_s))
        if self._player is not None:
            self._player.prepare()
        link.write("EventRate", RECORDS_HZ)
        assert link.hello is not None
        version = ".".join(map(str, link.hello.firmware_version))
        name = f"{DEVICE.name} at {settings.address}" + ", simulated" * self._simulated
        name += f", {'real-time' if self._real_time else 'ordinary'} priority"
        self._ready, self._told = True, ""
        self._parent.send(Ready(name))
        self._parent.send(Firmware(f"{DEVICE.name} {version}"))

    def _obey(self) -> None:
        """Do what was asked for since the last turn."""
        asked = self._words.take_asked()
        if asked is None:
            return
        try:
            self._do(asked)
        except DeviceRefused as refused:
            if refused.status != DeviceStatus.STATE:  # else its state says so
                self._tell(str(refused))
        self._see()

    def _do(self, asked: Ask) -> None:
        link = self._link
        if asked == Ask.ARM and not link.read("Homed"):
            link.write("Command", DeviceCommand.HOME)  # people confirm where the tool stands
        if asked == Ask.SHOW:
            link.write("Wall", self._words.wall())
            self._played_s = self._beat_s = now_s()
        if asked in _ASKED:
            link.write("Command", _ASKED[asked])

    def _mind(self, time_s: float) -> None:
        """Pass the session's heartbeat on while a wall is shown; let go where the sound ends."""
        beat_s, blocks = self._words.heartbeat_s, self._live.blocks_written
        if self._state != State.RUNNING:
            self._link.beat()  # nobody feels more than taut cables
        elif beat_s > self._beat_s:
            self._beat_s = beat_s
            self._link.beat()
        if blocks != self._blocks:
            self._blocks, self._played_s = blocks, time_s
        plays = self._state == State.RUNNING and self._settings.sound_s > 0 and blocks > 0
        if plays and time_s - self._played_s > self._settings.sound_s:
            self._link.write("Command", DeviceCommand.STOP)
            self._see(Cause.SOUND)

    def _look(self, time_s: float) -> None:
        if time_s - self._looked_s < LOOK_S:
            return
        self._looked_s = time_s
        self._see()
        if self._player is not None:
            reading = self._live.latest()
            self._player.look(
                speed_mm_s=0.0 if reading is None else float(reading["speed_mm_s"]),
                force_n=0.0 if reading is None else float(reading["force_n"]),
                heartbeat_s=self._words.heartbeat_s,
            )

    def _see(self, because: Cause | None = None) -> None:
        """Report the device's state; `because` stands for its own cause, which was to stop."""
        state = State(self._number("State"))
        cause = self._cause
        if state != self._state or state in (State.RELEASING, State.FAULT):
            cause = Cause(self._number("Cause"))
        if because is None and cause == Cause.STOPPED and self._cause == Cause.SOUND:
            because = Cause.SOUND
        self._report(state, cause if because is None else because)

    def _report(self, state: State, cause: Cause) -> None:
        self._state, self._cause = state, cause
        self._words.report(state, cause, time_s=now_s())

    def _number(self, name: str) -> int:
        value = self._link.read(name)
        assert isinstance(value, int)
        return value

    def _pass_on(self, blocks: list[Block]) -> None:
        """Records as readings, timed by their arrival: the device's speed is filtered already."""
        arrived_s = now_s()
        for n, block in enumerate(blocks):
            later = sum(one.values.size for one in blocks[n + 1 :])
            for k, row in enumerate(block.values):
                age_s = (later + block.values.size - 1 - k) * block.every / DEVICE_RATE_HZ
                flags = FORCE_COMMANDED | sum(
                    mine for theirs, mine in _FLAGS.items() if int(row["flags"]) & theirs
                )
                self._reading_s = max(self._reading_s, arrived_s - age_s)
                self._live.write_reading(
                    self._reading_s,
                    float(row["x_mm"]),
                    y_mm=0.0,
                    depth_mm=float(row["depth_mm"]),
                    speed_mm_s=float(row["speed_mm_s"]),
                    force_n=float(row["force_n"]),
                    flags=flags,
                )
            self._words.passed(block.values.size, depth_mm=float(block.values["depth_mm"][-1]))

    def _let_go(self) -> None:
        """Stop a device that may pull, and wait until it does not."""
        with suppress(InputError):
            if self._number("State") in (State.ARMED, State.RUNNING):
                self._link.write("Command", DeviceCommand.STOP)
                end_s = now_s() + 0.2
                while now_s() < end_s and self._number("State") == State.RELEASING:
                    sleep(TURN_S)
            self._link.write("EventRate", 0)

    def _write_gone(self) -> None:
        self._words.write_gone(simulated=self._simulated)


if __name__ == "__main__":
    main()
