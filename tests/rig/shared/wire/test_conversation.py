"""One host and one device over a wire that loses and damages bytes; and the wrong devices."""

from __future__ import annotations

import os
import pty
import random
import struct
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.virtual import VirtualBoard, VirtualTransport
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.rig.shared.wire.conversation import Conversation
from tactileq.rig.shared.wire.envelope import REPLY, WireFrame, WireReader
from tactileq.rig.shared.wire.transports import SerialTransport, SocketTransport, TransportLost
from tests.refusals import refused


class DamagedWire(VirtualTransport):
    """A board behind a wire on which a share of the bytes is lost or damaged, both ways."""

    def __init__(self, seed: int, share: float) -> None:
        super().__init__(VirtualBoard(compiled_device()))
        self._chance = random.Random(seed)
        self._share = share

    def read(self, within_s: float) -> bytes:
        return self._damaged(super().read(within_s))

    def write(self, data: bytes) -> None:
        super().write(self._damaged(data))

    def _damaged(self, data: bytes) -> bytes:
        out = bytearray()
        for byte in data:
            draw = self._chance.random() / self._share
            if draw < 0.4:
                continue
            out.append(byte if draw > 0.8 else self._chance.randrange(256))
        return bytes(out)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_written_over_a_bad_wire_is_done_once(seed: int) -> None:
    """Samples are counted where they arrive: none is lost, and none is doubled."""
    wire = DamagedWire(seed, 0.001)
    talk = Conversation(wire, DEVICE)
    talk.hello()
    written = 0
    for _ in range(39):  # of 25 each; 1000 fit
        talk.write("Samples", (1.0,) * 25)
        written += 25
        assert talk.read("SamplesQueued") == written
    assert talk.counts["repeated"] > 0
    assert talk.counts["damaged"] > 0


def test_a_wire_that_is_too_bad_ends_the_conversation() -> None:
    wire = DamagedWire(3, 0.002)
    talk = Conversation(wire, DEVICE)
    talk.hello()
    wire._share = 0.9
    answers = 0
    for _ in range(10):
        with suppress(TransportLost):
            talk.read("State")
            answers += 1
    assert answers < 10


@contextmanager
def answering(answer: Callable[[bytes], bytes]) -> Iterator[str]:
    """The path of a port at whose other end something answers to what it gets."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    ended = threading.Event()

    def run() -> None:
        while not ended.is_set():
            os.write(ours, answer(os.read(ours, 4096)))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield os.ttyname(theirs)
    finally:
        ended.set()
        os.write(theirs, b"\0")  # wakes it
        thread.join(500)
        os.close(theirs)
        os.close(ours)


PACKED = 256 * DEVICE.firmware_version[0] + DEVICE.firmware_version[1]
VERSION = ".".join(map(str, DEVICE.firmware_version))
HASH = f"{DEVICE.schema_hash:016x}"


def hello_of(who: int, version: int, schema: int) -> Callable[[bytes], bytes]:
    """A device that says this of itself."""
    reader = WireReader()

    def answer(data: bytes) -> bytes:
        body = b"\0" + struct.pack("<HHQfBI", who, version, schema, 5000.0, 8, 0)
        frames = list(reader.feed(data))
        return b"".join(WireFrame(f.kind | REPLY, f.sequence, 5, body).encoded() for f in frames)

    return answer


@pytest.mark.parametrize(
    ("answer", "facts"),
    [
        (hello_of(1, PACKED, DEVICE.schema_hash), {"got": "kind 1"}),
        (
            hello_of(29012, 512, DEVICE.schema_hash),
            {"expected": VERSION, "got": "2.0"},
        ),
        (
            hello_of(29012, PACKED, 77),
            {"expected": HASH, "got": f"{77:016x}"},
        ),
        (lambda _: b"$P,0,1000000,12500,-300,1500,1*64A5\n", {"got": "bytes that are no frames"}),
        (lambda _: b"\0\1\2\0\3\0", {"got": "bytes that are no frames"}),
        (lambda _: b"", {"got": "nothing"}),
    ],
    ids=["another device", "firmware", "schema", "text", "bytes", "silence"],
)
def test_another_device_at_the_port_is_refused(
    answer: Callable[[bytes], bytes], facts: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.shared.wire.conversation.HELLO_S", 0.5)
    with answering(answer) as path:
        port = SerialTransport(path, 115_200)
        try:
            with refused(InputError, names=path, **facts):
                Conversation(port, DEVICE).hello()
        finally:
            port.close()


def test_a_second_opener_is_refused() -> None:
    with answering(lambda _: b"") as path:
        port = SerialTransport(path, 115_200)
        try:
            with refused(InputError, names=path, got="another program"):
                SerialTransport(path, 115_200)
        finally:
            port.close()


def test_a_port_or_socket_that_there_is_not_is_refused() -> None:
    with refused(InputError, names="/dev/none"):
        SerialTransport("/dev/none", 115_200)
    for address in ("socket://127.0.0.1:1", "socket://nobody", "socket://127.0.0.1:99999"):
        with refused(InputError, names=address):
            SocketTransport(address)
