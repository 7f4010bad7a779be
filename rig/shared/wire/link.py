"""A device in a thread of its own: commands with deadlines, records, heartbeat, reconnecting."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.clock import taking_part, wait_for
from tactileq.rig.shared.wire.conversation import Block, Conversation, Hello, upload_bodies
from tactileq.rig.shared.wire.definition import Definition, Value
from tactileq.rig.shared.wire.transports import Transport, TransportLost

KEEP_S = 0.025  # a device that is not spoken to for 0.1 s lets go
BEAT_S = 0.1  # a heartbeat of the control loop is passed on so often at most
COMMAND_S = 5.0  # of a busy computer; the device itself lets go after 0.1 s
UPLOAD_S = 20.0
AGAIN_S = 0.5  # between attempts to open it again
_MOST_COMMANDS = 32
_MOST_FAULTS = 1000
_LISTEN_S = 0.01


@dataclass
class _Command:
    do: Callable[[Conversation], Any]
    answer: Future[Any]


class Link:
    """A device that is talked to by one thread while this is open.

    Losing the transport fails what is asked, is a fault, and is followed by attempts to open it
    again. A device that was lost is never armed again by this: whoever wants it asks for it.

    Parameters
    ----------
    opening : callable
        Gives an open transport; InputError where it cannot.
    definition : Definition
    """

    def __init__(self, opening: Callable[[], Transport], definition: Definition) -> None:
        self._opening = opening
        self._definition = definition
        self._commands: queue.Queue[_Command] = queue.Queue(_MOST_COMMANDS)
        self._blocks: deque[Block] = deque(maxlen=4096)
        self._faults: deque[str] = deque(maxlen=_MOST_FAULTS)
        self._transport: Transport | None = None
        self._closing = threading.Event()
        self._connected = threading.Event()
        self._thread: threading.Thread | None = None
        self._beats = self._beaten = 0
        self._beat_s = 0.0
        self._counts = {"repeated": 0, "damaged": 0, "missing": 0, "dropped": 0, "lost": 0}
        self.hello: Hello | None = None

    def open(self) -> Hello:
        """Connect; what the device says of itself.

        Raises
        ------
        InputError
            If it cannot be opened, or is another device.
        """
        talk = self._connect()
        self._closing.clear()
        self._thread = threading.Thread(target=self._run, args=(talk,), daemon=True)
        self._thread.start()
        assert self.hello is not None
        return self.hello

    def close(self) -> None:
        """End the thread and give the transport back; a device that was armed lets go by itself."""
        self._closing.set()
        if (transport := self._transport) is not None:
            transport.wake()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    @property
    def connected(self) -> bool:
        """Whether the device is there now."""
        return self._connected.is_set()

    def read(self, name: str, *, within_s: float = COMMAND_S) -> Value:
        """What a register holds; see `Conversation.read`."""
        value: Value = self._ask(lambda talk: talk.read(name), within_s)
        return value

    def write(self, name: str, value: Value, *, within_s: float = COMMAND_S) -> Value:
        """Write a register; see `Conversation.write`."""
        applied: Value = self._ask(lambda talk: talk.write(name, value), within_s)
        return applied

    def upload(self, data: bytes, digest: int, *, within_s: float = UPLOAD_S) -> None:
        """Send a model, other commands in between; see `Conversation.upload`."""
        for body in upload_bodies(data, digest):
            self._ask(partial(_upload_part, body), within_s)

    def beat(self) -> None:
        """Say that the control loop goes on; where nobody does for a second the device lets go."""
        self._beats += 1

    def blocks(self) -> list[Block]:
        """The records that came since the last call."""
        taken = []
        with suppress(IndexError):
            while True:
                taken.append(self._blocks.popleft())
        return taken

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each."""
        taken = []
        with suppress(IndexError):
            while True:
                taken.append(self._faults.popleft())
        return tuple(taken)

    def counts(self) -> dict[str, int]:
        """Of the connection: frames repeated or damaged, records missing or dropped, times lost."""
        return dict(self._counts)

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, do: Callable[[Conversation], Any], within_s: float) -> Any:
        if not self._connected.is_set():
            raise _gone()
        command = _Command(do, Future())
        try:
            self._commands.put_nowait(command)
        except queue.Full:
            raise InputError(
                f"expected at most {_MOST_COMMANDS} commands that wait for the device, got one "
                "more; wait for the answers."
            ) from None
        if (transport := self._transport) is not None:
            transport.wake()
        if not wait_for(lambda s: bool(wait([command.answer], s).done), within_s):
            command.answer.cancel()
            raise InputError(
                f"expected the device to answer within {within_s:g} s, got nothing; check its "
                "cable and power."
            )
        return command.answer.result()

    def _connect(self) -> Conversation:
        transport = self._opening()
        try:
            talk = Conversation(transport, self._definition)
            try:
                self.hello = talk.hello()
            except TransportLost as lost:
                raise InputError(
                    f"expected a device that stays, got an end: {lost} Check its cable and power."
                ) from None
        except BaseException:
            transport.close()
            raise
        self._transport = transport
        self._connected.set()
        return talk

    def _run(self, talk: Conversation) -> None:
        """Talk, and anew where it was lost, until this is closed."""
        current: Conversation | None = talk
        while current is not None:
            try:
                with taking_part():
                    while not self._closing.is_set():
                        self._step(current)
            except TransportLost as lost:
                self._counts["lost"] += 1
                self._faults.append(str(lost))
            self._disconnect()
            current = self._again()

    def _step(self, talk: Conversation) -> None:
        now_s = talk.now_s()
        if self._beats != self._beaten and now_s - self._beat_s >= BEAT_S:
            self._beaten, self._beat_s = self._beats, now_s
            talk.write("Heartbeat", self._beaten & 0xFFFFFFFF)
        try:
            command = self._commands.get_nowait()
        except queue.Empty:
            if now_s - talk.exchanged_s >= KEEP_S:
                talk.read("State")
            else:
                talk.listen(_LISTEN_S)
        else:
            _do(command, talk)
        self._blocks.extend(talk.blocks())
        for name, count in talk.counts.items():
            self._counts[name] = count

    def _disconnect(self) -> None:
        self._connected.clear()
        if self._transport is not None:
            self._transport.close()
        with suppress(queue.Empty):
            while True:
                answer = self._commands.get_nowait().answer
                if answer.set_running_or_notify_cancel():  # somebody waits for it still
                    answer.set_exception(_gone())

    def _again(self) -> Conversation | None:
        """A new connection, None once this is closed; nothing is armed."""
        while not wait_for(self._closing.wait, AGAIN_S):
            with suppress(InputError):
                return self._connect()
        return None


def _upload_part(body: bytes, talk: Conversation) -> None:
    talk.upload_part(body)


def _do(command: _Command, talk: Conversation) -> None:
    if not command.answer.set_running_or_notify_cancel():
        return
    try:
        command.answer.set_result(command.do(talk))
    except InputError as refused:
        command.answer.set_exception(refused)
    except TransportLost:
        command.answer.set_exception(_gone())
        raise


def _gone() -> InputError:
    return InputError(
        "expected a device at the other end, got none; plug it in again, then arm it anew."
    )
