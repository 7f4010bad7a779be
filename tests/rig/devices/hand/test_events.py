"""Events of Linux input devices: layout, frames however they are cut, pens and mice."""

from __future__ import annotations

import subprocess
from math import isnan
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.rig.devices.hand import evdev
from tactileq.rig.devices.hand.events import (
    ABS_PRESSURE,
    ABS_X,
    ABS_Y,
    BTN_LEFT,
    BTN_STYLUS,
    BTN_TOOL_PEN,
    BTN_TOOL_RUBBER,
    BTN_TOUCH,
    EV_ABS,
    EV_KEY,
    EV_REL,
    EV_SYN,
    EVENT,
    REL_X,
    REL_Y,
    SYN_DROPPED,
    SYN_REPORT,
    AbsoluteAxis,
    Event,
    Frame,
    FrameReader,
    MouseHand,
    PenHand,
)
from tactileq.rig.devices.hand.pressure import PressureCurve

NAMES = (
    *("EV_SYN", "EV_KEY", "EV_REL", "EV_ABS", "SYN_REPORT", "SYN_DROPPED", "REL_X", "REL_Y"),
    *("ABS_X", "ABS_Y", "ABS_PRESSURE", "BTN_LEFT", "BTN_TOOL_PEN", "BTN_TOOL_RUBBER"),
    *("BTN_TOUCH", "BTN_STYLUS"),
)


def packed(type_: int, code: int, value: int, *, time_s: float = 1.5) -> bytes:
    return EVENT.pack(int(time_s), round(time_s % 1 * 1e6), type_, code, value)


REPORT = packed(EV_SYN, SYN_REPORT, 0)


def test_layout_codes_and_requests_are_those_of_the_kernels_headers(tmp_path: Path) -> None:
    requests = {
        "EVIOCGKEY(96)": evdev.EVIOCGKEY,
        "EVIOCGRAB": evdev.EVIOCGRAB,
        "EVIOCSCLOCKID": evdev.EVIOCSCLOCKID,
        "EVIOCGBIT(EV_KEY, 96)": evdev.eviocgbit(EV_KEY, 96),
        "EVIOCGABS(ABS_PRESSURE)": evdev.eviocgabs(ABS_PRESSURE),
        "sizeof(struct input_event)": EVENT.size,
        "offsetof(struct input_event, value)": EVENT.size - 4,
        "sizeof(struct input_absinfo)": 24,
        "offsetof(struct input_absinfo, resolution)": 20,
        "(KEY_CNT + 7) / 8": 96,
    } | {name: globals()[name] for name in NAMES}
    prints = "\n".join(f'printf("%ld\\n", (long)(unsigned)({name}));' for name in requests)
    (tmp_path / "codes.c").write_text(
        f"#include <linux/input.h>\n#include <stddef.h>\n#include <stdio.h>\n"
        f"int main(void) {{ {prints} return 0; }}\n",
        encoding="utf-8",
    )
    subprocess.run(["gcc", "codes.c", "-o", "codes"], cwd=tmp_path, check=True)
    run = subprocess.run([tmp_path / "codes"], capture_output=True, text=True, check=True)
    assert dict(zip(requests, map(int, run.stdout.split()), strict=True)) == requests


def test_frames_end_with_a_report_and_carry_its_time() -> None:
    stream = packed(EV_ABS, ABS_X, 7) + packed(EV_KEY, BTN_TOUCH, 1) + REPORT + REPORT
    assert FrameReader().feed(stream) == [
        Frame(1.5, (Event(EV_ABS, ABS_X, 7), Event(EV_KEY, BTN_TOUCH, 1)), dropped=False),
        Frame(1.5, (), dropped=False),
    ]


def test_after_a_loss_all_up_to_the_next_report_is_thrown_away() -> None:
    reader = FrameReader()
    stream = packed(EV_ABS, ABS_X, 1) + packed(EV_SYN, SYN_DROPPED, 0) + packed(EV_ABS, ABS_Y, 2)
    assert reader.feed(stream) == []
    after = packed(EV_ABS, ABS_X, 3) + REPORT
    assert reader.feed(REPORT + after) == [
        Frame(1.5, (), dropped=True),
        Frame(1.5, (Event(EV_ABS, ABS_X, 3),), dropped=False),
    ]
    assert (reader.frames, reader.dropped) == (2, 1)


events = st.builds(
    packed,
    st.sampled_from([EV_SYN, EV_KEY, EV_REL, EV_ABS]),
    st.sampled_from([0, 1, SYN_DROPPED, ABS_PRESSURE, BTN_TOUCH, BTN_TOOL_PEN, BTN_LEFT]),
    st.integers(-(2**31), 2**31 - 1),
    time_s=st.floats(0, 1e6),
)
streams = st.lists(events | st.just(REPORT) | st.binary(max_size=50), max_size=20).map(b"".join)


@settings(max_examples=200, deadline=None)
@given(streams, st.data())
def test_any_bytes_in_any_pieces_give_the_same_frames(stream: bytes, data: st.DataObject) -> None:
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    reader = FrameReader()
    frames = FrameReader().feed(stream)
    assert [frame for piece in pieces for frame in reader.feed(piece)] == frames
    for hand in (pen(), MouseHand(40.0)):
        for frame in frames:
            sample = hand.sample(frame)
            assert sample.force_n is None or 0 <= sample.force_n < 1e9


def pen(*, curve: PressureCurve | None = None, pressure: bool = True) -> PenHand:
    """1000 counts from −100 up at 10 per mm; the pen is out of reach."""
    axes = {ABS_X: AbsoluteAxis(-100, 900, 10.0), ABS_Y: AbsoluteAxis(0, 500, 20.0)}
    if pressure:
        axes[ABS_PRESSURE] = AbsoluteAxis(0, 2000)
    curve = curve or PressureCurve(((0.0, 0.0), (0.5, 1.0), (1.0, 4.0)))
    keys = (BTN_TOOL_PEN, BTN_TOOL_RUBBER, BTN_TOUCH, BTN_STYLUS)
    return PenHand(axes, curve, state={(EV_KEY, key): 0 for key in keys})


def frame(*events: tuple[int, int, int], time_s: float = 2.0) -> Frame:
    return Frame(time_s, tuple(Event(*event) for event in events), dropped=False)


def test_a_pen_comes_near_touches_presses_and_goes() -> None:
    hand = pen()
    assert isnan(hand.sample(frame()).x_mm)
    near = hand.sample(frame((EV_KEY, BTN_TOOL_PEN, 1), (EV_ABS, ABS_X, 0), (EV_ABS, ABS_Y, 40)))
    assert near[1:] == (10.0, 2.0, None, 0.0, False, False)
    down = hand.sample(frame((EV_KEY, BTN_TOUCH, 1), (EV_ABS, ABS_PRESSURE, 1500)))
    assert down[1:] == (10.0, 2.0, None, 2.5, True, False)
    pressed = hand.sample(frame((EV_KEY, BTN_STYLUS, 1), (EV_ABS, ABS_X, 5)))
    assert pressed[1:] == (10.5, 2.0, None, 2.5, True, True)
    gone = hand.sample(frame((EV_KEY, BTN_TOOL_PEN, 0)))
    assert isnan(gone.x_mm)
    assert (gone.force_n, gone.contact) == (0, False)


def test_the_rubber_end_is_in_reach_too() -> None:
    assert pen().sample(frame((EV_KEY, BTN_TOOL_RUBBER, 1), (EV_ABS, ABS_X, 0))).x_mm == 10.0


def test_without_a_curve_or_pressure_force_is_not_measured() -> None:
    assert pen(pressure=False).sample(frame()).force_n is None
    hand = PenHand({ABS_X: AbsoluteAxis(0, 9, 1), ABS_Y: AbsoluteAxis(0, 9, 1)}, None, state={})
    touching = hand.sample(frame((EV_ABS, ABS_X, 3), (EV_ABS, ABS_Y, 4), (EV_KEY, BTN_TOUCH, 1)))
    # A tablet that names no tool among its keys has its pen always in reach.
    assert touching[1:] == (3.0, 4.0, None, None, True, False)


def test_after_a_loss_the_pen_is_where_the_tablet_says() -> None:
    hand = pen()
    hand.renew({(EV_KEY, BTN_TOOL_PEN): 1, (EV_ABS, ABS_X): 100, (EV_ABS, ABS_Y): 20})
    assert hand.sample(Frame(1.0, (), dropped=True))[1:3] == (20.0, 1.0)


def test_a_mouse_sums_its_counts() -> None:
    mouse = MouseHand(40.0)
    mouse.sample(frame((EV_REL, REL_X, 10), (EV_REL, REL_Y, -4)))
    moved = mouse.sample(frame((EV_REL, REL_X, 10), (EV_KEY, BTN_LEFT, 1), time_s=3.0))
    assert moved == (3.0, 0.5, -0.1, None, None, True, True)
    mouse.renew({(EV_KEY, BTN_LEFT): 0})
    assert not mouse.sample(frame()).button


@pytest.mark.parametrize(("value", "share"), [(0, 0.0), (500, 0.5), (1000, 1.0)])
def test_a_share_of_the_range(value: int, share: float) -> None:
    assert AbsoluteAxis(0, 1000).share(value) == share
