"""Every message between processes of a rig, there and back; and what is none."""

from __future__ import annotations

import io
from contextlib import suppress
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.desk import messages as pen
from tactileq.rig.devices.hand import messages as hand
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.monitoring import bare_thread  # noqa: F401 (its messages)
from tactileq.rig.devices.simulated import process  # noqa: F401
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.devices.sound import messages as sound
from tactileq.rig.machines.force import messages  # noqa: F401
from tactileq.rig.machines.force.settings import ForceSettings, Pose
from tactileq.rig.recording.capture.input import InputSettings
from tactileq.rig.shared.live.messages import Message, Refused, decoded, received, send
from tests.refusals import refused

UNIONS = (sound.Request, hand.Report, pen.Request)
KINDS = sorted(
    (kind for kind in Message.__subclasses__() if kind.__module__.startswith("tactileq.rig.")),
    key=lambda kind: f"{kind.__module__} {kind.__name__}",
)
# Of settings that check themselves, some that are accepted.
MADE: dict[Any, st.SearchStrategy[Any]] = {
    HandSettings: st.sampled_from(
        [
            HandSettings(kind="tablet", pressure_points=((0.0, 0.0), (0.5, 1.0), (1.0, 4.0))),
            HandSettings(kind="mouse", counts_per_mm=40.0, assumed_force_n=1.0, grab=True),
            HandSettings(kind="scripted", script="hold", speed_mm_s=-80.0),
        ]
    ),
    ForceSettings: st.sampled_from(
        [
            ForceSettings(),
            ForceSettings(library="stand-in", serial=7, late_s=0.019, watched=False),
            ForceSettings(pose=Pose(origin_mm=(1.5, -2.0, 3.0), x=(0.0, 1.0, 0.0))),
        ]
    ),
    SimulatedTransducers: st.builds(SimulatedTransducers, seed=st.integers(0, 100)),
    RenderCounters: st.builds(RenderCounters),
    float: st.floats(allow_nan=False),
    int: st.integers(0, 2**64 - 1),  # keys of noise have 64 bits
}


def values_of(kind: Any) -> st.SearchStrategy[Any]:
    """Values of a field's type."""
    if kind in MADE:
        return MADE[kind]
    if isinstance(kind, type) and issubclass(kind, Message):
        return made(kind)
    if isinstance(kind, UnionType):
        return st.one_of(*map(values_of, get_args(kind)))
    if get_origin(kind) is tuple:
        return st.lists(values_of(get_args(kind)[0]), max_size=3).map(tuple)
    if get_origin(kind) is dict:
        return st.dictionaries(*map(values_of, get_args(kind)), max_size=3)
    return st.from_type(kind)


def made(kind: type[Message]) -> st.SearchStrategy[Message]:
    """Messages of a type."""
    fields = {name: get_type_hints(kind)[name] for name in kind.__struct_fields__}
    return st.builds(kind, **{name: values_of(field) for name, field in fields.items()})


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@given(data=st.data())
def test_there_and_back(kind: type[Message], data: st.DataObject) -> None:
    sent = data.draw(st.lists(made(kind), max_size=3))
    pipe = io.BytesIO()
    for message in sent:
        send(pipe, message)
    pipe.seek(0)
    assert [decoded(one, kind | Refused) for one in received(pipe)] == sent


def test_settings_of_an_input_there_and_back_with_numbers_of_numpy() -> None:
    pipe = io.BytesIO()
    send(pipe, InputSettings(np.float64(20), device="card", channel=2, rate_hz=48000))
    (data,) = received(io.BytesIO(pipe.getvalue()))
    assert decoded(data, InputSettings) == InputSettings(20.0, "card", 2, rate_hz=48000)


@pytest.mark.parametrize("union", UNIONS, ids=["sound", "hand", "pen"])
@given(data=st.binary(max_size=40))
def test_bytes_of_any_kind_are_a_message_or_refused(union: Any, data: bytes) -> None:
    with suppress(InputError):  # and no other error
        assert isinstance(decoded(data, union), get_args(union))


def test_another_message_and_a_wrong_field_are_refused() -> None:
    for message, kinds, got in (
        (sound.Mask(0.1), pen.Request, "Mask"),
        (sound.Mask("loud"), sound.Request, "str"),  # type: ignore[arg-type]
    ):
        pipe = io.BytesIO()
        send(pipe, message)
        with refused(InputError, expected="message", got=got):
            decoded(pipe.getvalue()[4:], kinds)


def test_a_message_that_is_cut_off_is_left_out() -> None:
    pipe = io.BytesIO()
    send(pipe, sound.PlaySignal(1, bytes(100)))
    assert list(received(io.BytesIO(pipe.getvalue()[:-1]))) == []
    assert len(list(received(io.BytesIO(pipe.getvalue() + b"\0\0")))) == 1


def test_text_in_the_pipe_is_refused() -> None:
    (data, *_) = received(io.BytesIO(b"Warning: something\n"))
    with refused(InputError, expected="message", got="another"):
        decoded(data, sound.Request)
