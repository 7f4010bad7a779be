"""Frames: bytes there and back, whatever comes between them."""

from __future__ import annotations

import binascii
import zlib

from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.rig.shared.wire.envelope import LONGEST, Kind, WireFrame, WireReader
from tests.refusals import refused

FRAMES = st.builds(
    WireFrame,
    st.sampled_from([*Kind, *(kind | 0x80 for kind in Kind)]),
    st.integers(0, 2**16 - 1),
    st.integers(0, 2**32 - 1),
    st.binary(max_size=236),
)


def test_the_checks_are_those_of_the_catalogue() -> None:
    """CRC-16/IBM-3740 and CRC-32/ISO-HDLC: Cook's catalogue of parametrised CRC algorithms."""
    assert binascii.crc_hqx(b"123456789", 0xFFFF) == 0x29B1
    assert zlib.crc32(b"123456789") == 0xCBF43926


@given(FRAMES)
def test_a_frame_comes_back(frame: WireFrame) -> None:
    data = frame.encoded()
    assert data[0] == data[-1] == 0
    assert 0 not in data[1:-1]
    assert list(WireReader().feed(data)) == [frame]


@given(st.lists(FRAMES, max_size=5), st.integers(1, 7))
def test_frames_come_in_pieces(frames: list[WireFrame], piece: int) -> None:
    data = b"".join(frame.encoded() for frame in frames)
    reader = WireReader()
    found = [
        frame for at in range(0, len(data), piece) for frame in reader.feed(data[at : at + piece])
    ]
    assert found == frames
    assert reader.bad == 0


@given(FRAMES, FRAMES, st.data())
def test_a_damaged_frame_does_not_cost_the_next(
    first: WireFrame, second: WireFrame, data: st.DataObject
) -> None:
    good = first.encoded()
    kept = data.draw(st.integers(1, len(good) - 2))  # the end, and its zero, are lost
    reader = WireReader()
    assert list(reader.feed(good[:kept] + second.encoded())) == [second]
    assert reader.bad == (kept > 1)


@given(st.binary(max_size=2000), FRAMES)
def test_whatever_came_before_the_next_frame_is_found(noise: bytes, frame: WireFrame) -> None:
    *_, last = WireReader().feed(noise + frame.encoded())
    assert last == frame


def test_a_body_that_is_too_long_is_refused() -> None:
    with refused(InputError, expected=236, got=237):
        WireFrame(Kind.READ, 0, 0, bytes(237)).encoded()
    too_long = cobs.encode(b"\2" + bytes(LONGEST))
    assert WireFrame.decoded(too_long) is None
