"""One host talking to one device: hello, reading and writing registers, uploads, records.

It waits for each reply before it sends more, repeats a frame that was not answered (which the
device then does once), and knows no thread; `tactileq.rig.shared.wire.link` has one.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.wire.definition import Definition, Register, Value
from tactileq.rig.shared.wire.envelope import REPLY, Kind, WireFrame, WireReader
from tactileq.rig.shared.wire.transports import Transport, TransportLost

DEADLINE_S = 0.3
AGAIN_S = 0.06  # without an answer a frame is sent again
UPLOAD_S, UPLOAD_AGAIN_S = 3.0, 0.5  # the same of an upload, whose frames are long
HELLO_S = 3.0  # many boards restart when their port is opened
_HELLO_AGAIN_S = 0.2
_HELLO = struct.Struct("<HHQfBI")
_EVENT = struct.Struct("<IIHB")
_STATUS_OK, _STATUS_NONCE, _STATUS_SEQUENCE, _STATUS_MODEL, _STATUS_BUSY = 0, 6, 7, 10, 11
_MOST_DATA = 231  # bytes of an upload's body less its own head
_BUSY_S = 0.1
_MOST_BLOCKS = 4096

RECORD = np.dtype(
    [
        ("x_mm", "<f4"),
        ("depth_mm", "<f4"),
        ("speed_mm_s", "<f4"),
        ("force_n", "<f4"),
        ("vibration_g", "<f4"),
        ("flags", "u1"),
    ]
)


_MEASURED = ("x_mm", "depth_mm", "speed_mm_s", "force_n", "vibration_g")


class DeviceRefused(InputError):
    """The device answered that it does not; `status` says why."""

    def __init__(self, sentence: str, status: int) -> None:
        super().__init__(sentence)
        self.status = status


class OtherDevice(InputError):
    """A device of another kind answered."""


@dataclass(frozen=True)
class Hello:
    """What a device said of itself.

    Parameters
    ----------
    real_size : int
        Bytes of a number of its kernel.
    tick : int
        Of its clock, at the hello.
    """

    who_am_i: int
    firmware_version: tuple[int, int]
    schema_hash: int
    tick_rate_hz: float
    real_size: int
    tick: int


@dataclass(frozen=True, eq=False)
class Block:
    """Records of one frame, of ticks `tick`, `tick + every`, …

    Parameters
    ----------
    number : int
        Of the first one, since the rate was set; a gap shows what was lost.
    values : (n,) ndarray of RECORD
    """

    number: int
    tick: int
    every: int
    values: np.ndarray[Any, np.dtype[Any]]


def upload_bodies(data: bytes, digest: int) -> list[bytes]:
    """What is sent one after another to upload a model with this hash."""
    begin, end = struct.pack("<BI", 0, len(data)), struct.pack("<BQ", 2, digest)
    parts = range(0, len(data), _MOST_DATA)
    return [
        begin,
        *(struct.pack("<BI", 1, at) + data[at : at + _MOST_DATA] for at in parts),
        end,
    ]


class Conversation:
    """A device at the other end of a transport.

    Parameters
    ----------
    transport : Transport
        Is not closed by this.
    definition : Definition
        What both sides have to agree on.
    """

    def __init__(self, transport: Transport, definition: Definition) -> None:
        self._transport = transport
        self._definition = definition
        self._reader = WireReader()
        self._heard = 0  # bytes
        self._sequence = 0
        self._nonce = 0
        self._statuses = {
            value: (name, meaning)
            for name, (value, meaning) in definition.masks["Status"].members.items()
        }
        self._blocks: deque[Block] = deque()
        self._next_record: int | None = None
        self.counts = {"repeated": 0, "damaged": 0, "missing": 0, "dropped": 0}
        self.exchanged_s = transport.now_s()

    def now_s(self) -> float:
        """The transport's clock."""
        return self._transport.now_s()

    def hello(self) -> Hello:
        """Begin anew; a device that was armed lets go.

        Raises
        ------
        OtherDevice
        InputError
            If nothing answers, what is no device does, or one with another schema or firmware.
        TransportLost
        """
        self._sequence, self._nonce = 0, 0
        frame = WireFrame(Kind.HELLO, 0, 0)
        before = self._heard
        reply = self._reply(frame, within_s=HELLO_S, again_s=_HELLO_AGAIN_S)
        if reply is None:
            raise self._unanswered(something=self._heard > before)
        if len(reply.body) != 1 + _HELLO.size:
            raise InputError(self._other("a hello of another length"))
        who, version, schema, rate, size, tick = _HELLO.unpack(reply.body[1:])
        hello = Hello(who, divmod(version, 256), schema, rate, size, tick)
        self._check(hello)
        self._nonce, self._next_record = reply.nonce, None
        return hello

    def read(self, name: str) -> Value:
        """What a register holds.

        Raises
        ------
        InputError
            For a name that there is not, or no answer in time.
        """
        register = self._register(name)
        body = self.exchange(Kind.READ, bytes([register.address]), f"to read {name}")
        return register.decoded(body[1:])

    def write(self, name: str, value: Value) -> Value:
        """Write a register; the value that the device applied.

        Raises
        ------
        InputError
            For a value out of its range, before it is sent.
        DeviceRefused
            Where the device does not take it, and why.
        """
        register = self._register(name)
        body = bytes([register.address]) + register.encoded(value)
        applied = self.exchange(Kind.WRITE, body, f"to write {name}")
        return register.decoded(applied[1:])

    def upload(self, data: bytes, digest: int) -> None:
        """Send a model, and have the device use it once the one before has faded out.

        Parameters
        ----------
        data : bytes
        digest : int
            Its hash, which the device compares (`tactileq.rig.machines.device.models`).

        Raises
        ------
        DeviceRefused
            If it is too large, or no model to this device.
        """
        for body in upload_bodies(data, digest):
            self.upload_part(body)

    def upload_part(self, body: bytes) -> None:
        """Send one of `upload_bodies`; see `upload`."""
        end_s = self._transport.now_s() + _BUSY_S
        while True:
            try:
                self.exchange(Kind.UPLOAD, body, "to take a model")
                return
            except DeviceRefused as refused:
                if refused.status == _STATUS_MODEL:
                    raise self._no_model() from None
                if refused.status != _STATUS_BUSY or self._transport.now_s() > end_s:
                    raise

    def _no_model(self) -> DeviceRefused:
        """Which part of an upload the device has refused."""
        fault = self.read("ModelFault")
        members = self._definition.masks["ModelFault"].members
        name = next((name for name, (value, _) in members.items() if value == fault), str(fault))
        return DeviceRefused(
            f"expected a model that the device can render, got one that it refuses for its "
            f"{name.lower()}; see docs/device.md#models.",
            _STATUS_MODEL,
        )

    def exchange(self, kind: Kind, body: bytes, what: str) -> bytes:
        """Send one frame and wait for its reply; the body without the status.

        Raises
        ------
        DeviceRefused
            With another status than OK.
        TransportLost
            Without a reply.
        """
        self._sequence = (self._sequence + 1) & 0xFFFF
        frame = WireFrame(kind, self._sequence, self._nonce, body)
        long = kind == Kind.UPLOAD
        within_s, again_s = (UPLOAD_S, UPLOAD_AGAIN_S) if long else (DEADLINE_S, AGAIN_S)
        reply = self._reply(frame, within_s=within_s, again_s=again_s)
        if reply is None:
            raise TransportLost(
                f"the device at {self._transport.name} did not answer for {within_s:g} s."
            )
        status = reply.body[0]
        if status in (_STATUS_NONCE, _STATUS_SEQUENCE):
            raise TransportLost(f"the device at {self._transport.name} has started anew.")
        if status != _STATUS_OK:
            name, meaning = self._statuses.get(status, (str(status), "unknown"))
            raise DeviceRefused(
                f"expected the device {what}, got a refusal ({name}: {meaning or name.lower()}); "
                "see docs/device.md.",
                status,
            )
        return reply.body[1:]

    def listen(self, within_s: float) -> None:
        """Take in records as they come, at least once."""
        for frame in self._received(within_s):
            self._take(frame)

    def blocks(self) -> list[Block]:
        """The records that came since the last call."""
        taken = list(self._blocks)
        self._blocks.clear()
        return taken

    def _reply(self, frame: WireFrame, *, within_s: float, again_s: float) -> WireFrame | None:
        data, now_s = frame.encoded(), self._transport.now_s()
        end_s, send_s, sent = now_s + within_s, now_s, 0
        found: WireFrame | None = None
        while now_s < end_s:
            if now_s >= send_s:
                self._transport.write(data)
                send_s = now_s + again_s
                self.counts["repeated"] += sent > 0
                sent += 1
            for got in self._received(min(send_s, end_s) - now_s):
                if found is None and self._answers(got, frame):
                    found = got
                else:  # also what came with it
                    self._take(got)
            now_s = self._transport.now_s()
            self.counts["damaged"] = self._reader.bad
            if found is not None:
                self.exchanged_s = now_s
                break
        return found

    def _received(self, within_s: float) -> list[WireFrame]:
        data = self._transport.read(max(0.0, within_s))
        self._heard += len(data)
        return list(self._reader.feed(data))

    @staticmethod
    def _answers(got: WireFrame, frame: WireFrame) -> bool:
        of = got.kind == frame.kind | REPLY and got.sequence == frame.sequence and bool(got.body)
        if not of or frame.kind == Kind.HELLO:
            return of
        return got.nonce == frame.nonce or got.body[0] == _STATUS_NONCE

    def _take(self, frame: WireFrame) -> None:
        """A frame that answers nothing: records, or what is out of date."""
        if frame.kind != Kind.EVENT | REPLY or frame.nonce != self._nonce:
            return
        if len(frame.body) < _EVENT.size:
            return
        number, tick, every, count = _EVENT.unpack_from(frame.body)
        values = frame.body[_EVENT.size :]
        if len(values) != count * RECORD.itemsize:
            return
        if self._next_record is not None and number > self._next_record:
            self.counts["missing"] += number - self._next_record
        self._next_record = number + count
        if len(self._blocks) >= _MOST_BLOCKS:
            self.counts["dropped"] += self._blocks.popleft().values.size
        block = Block(number, tick, every, np.frombuffer(values, dtype=RECORD))
        if np.isfinite([block.values[name] for name in _MEASURED]).all():
            self._blocks.append(block)

    def _register(self, name: str) -> Register:
        registers: Mapping[str, Register] = self._definition.registers
        if name not in registers:
            raise InputError(
                f"expected a register of {self._definition.name}, got {name}; see "
                "docs/device-registers.md."
            )
        return registers[name]

    def _check(self, hello: Hello) -> None:
        wanted = self._definition
        if hello.who_am_i != wanted.who_am_i:
            raise OtherDevice(self._other(f"a device of kind {hello.who_am_i}"))
        if hello.firmware_version != wanted.firmware_version:
            mine, other = (
                f"{major}.{minor}"
                for major, minor in (wanted.firmware_version, hello.firmware_version)
            )
            raise InputError(
                f"expected firmware {mine} in the device at {self._transport.name}, got {other}; "
                "load the one that came with this tactileq."
            )
        if hello.schema_hash != wanted.schema_hash:
            raise InputError(
                f"expected the registers of schema {wanted.schema_hash:016x} from the device at "
                f"{self._transport.name}, got {hello.schema_hash:016x}; load the firmware that "
                "came with this tactileq."
            )

    def _unanswered(self, *, something: bool) -> InputError:
        if something:
            return InputError(self._other("bytes that are no frames"))
        return InputError(
            f"expected a device at {self._transport.name} to answer within {HELLO_S:g} s, got "
            "nothing; check its power, its cable and its baud rate."
        )

    def _other(self, got: str) -> str:
        return (
            f"expected {self._definition.name} at {self._transport.name}, got {got}; check "
            "the port and its baud rate."
        )
