"""Models on the device: the host's samples, bit for bit, and what is refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from tactileq.benches.rendering.rivals import layered_texture
from tactileq.modeling import InputError, Limits, Renderer, TextureModel
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.rig.machines.device.models import DEVICE_LIMITS, device_model
from tactileq.rig.machines.device.registers import DeviceSource, DeviceStatus
from tactileq.rig.shared.wire.conversation import Block, DeviceRefused, Hello
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused
from tests.rig.machines.device.talking import Talk, joined

READ_TICKS = 5
HELLO = Hello(29012, (1, 0), 0, 5000.0, 8, 0)


def hosts_samples(
    model: TextureModel,
    blocks: list[Block],
    begin_tick: int,
    *,
    single: bool,
    compensation: Compensation | None = None,
) -> np.ndarray:
    """What the host renders from the same readings, from a model's first sample on."""
    renderer = Renderer(model, limits=DEVICE_LIMITS, compensation=compensation, single=single)
    values, tick, every = joined(blocks), blocks[0].tick, blocks[0].every
    assert tick <= begin_tick
    samples = []
    for n in range((begin_tick - tick) // every, values.size, READ_TICKS // every):
        renderer.read(float(values["speed_mm_s"][n]), float(values["force_n"][n]))
        samples.append(renderer.render_on(READ_TICKS))
    return np.concatenate(samples)


NOTCH = Compensation(rate_hz=5000.0, frequency_hz=240.0, bandwidth_hz=90.0, height=3.0)


@pytest.mark.parametrize("compensation", [None, NOTCH], ids=["plain", "compensated"])
def test_the_device_renders_the_bits_of_the_host(compensation: Compensation | None) -> None:
    """In double precision: through strokes, turns, and contact that begins and ends."""
    talk, model = Talk(), planted_texture("canvas")
    upload = device_model(model, HELLO, compensation=compensation)
    talk.push()
    blocks = talk.recorded(0.02)
    talk.upload(upload.data, upload.hash)
    talk.write("Source", DeviceSource.MODEL)
    blocks += talk.blocks()
    for _ in range(600):
        talk.write("Heartbeat", 1)
        talk.listen(0.004)
        blocks += talk.blocks()
    begin = talk.number("ModelTick")
    host = hosts_samples(model, blocks, begin, single=False, compensation=compensation)
    device = joined(blocks)["vibration_g"][begin - blocks[0].tick :]
    size = min(host.size, device.size)
    assert size > 5000
    assert np.abs(device[:size]).max() > 0.1
    assert np.array_equal(device[:size], host[:size].astype(np.float32))


def test_a_second_model_takes_over_through_silence() -> None:
    talk = Talk()
    talk.push()
    first, second = (device_model(planted_texture(name), HELLO) for name in ("canvas", "MDF"))
    talk.upload(first.data, first.hash)
    blocks = talk.recorded(0.3, source=DeviceSource.MODEL)
    talk.upload(second.data, second.hash)
    for _ in range(100):
        talk.write("Heartbeat", 1)
        talk.listen(0.004)
        blocks += talk.blocks()
    assert talk.number("ModelHash") == second.hash
    begin = talk.number("ModelTick")
    vibration = joined(blocks)["vibration_g"]
    at = begin - blocks[0].tick
    assert np.abs(vibration[at - 3 : at]).max() < 0.01
    assert not vibration[at : at + READ_TICKS].any()
    assert np.abs(vibration[:at]).max() > 0.05
    assert np.abs(vibration[at + 100 :]).max() > 0.01
    assert talk.read("State") == 3


@pytest.mark.parametrize(
    "spoilt",
    [
        lambda data: data[:-8],
        lambda data: b"TQM2" + data[4:],
        lambda data: data[:4] + b"\4" + data[5:],
        lambda data: data[:5] + b"\x7f" + data[6:],
        lambda data: data[:24] + struct.pack("<d", 4000.0) + data[32:],
        lambda data: data[:72] + struct.pack("<d", float("inf")) + data[80:],  # no peak
        lambda data: (
            data[:128] + struct.pack("<d", -1.0) + data[136:]
        ),  # an axis that does not rise
        lambda data: data[:-8] + struct.pack("<d", float("nan")),
        lambda data: data[:-8] + struct.pack("<d", 1e9),
    ],
    ids=["short", "name", "size", "layers", "rate", "peak", "axis", "nan", "gain"],
)
def test_what_is_no_model_is_refused_and_the_one_before_stays(spoilt) -> None:  # type: ignore[no-untyped-def]
    talk = Talk()
    good = device_model(planted_texture("canvas"), HELLO)
    talk.upload(good.data, good.hash)
    data = spoilt(good.data)
    other = type(good)(data)
    with pytest.raises(DeviceRefused) as told:
        talk.upload(data, other.hash)
    assert told.value.status == DeviceStatus.MODEL
    assert talk.number("ModelHash") == good.hash


def test_a_wrong_hash_is_refused() -> None:
    talk = Talk()
    good = device_model(planted_texture("canvas"), HELLO)
    with pytest.raises(DeviceRefused) as told:
        talk.upload(good.data, good.hash ^ 1)
    assert told.value.status == DeviceStatus.MODEL
    assert talk.number("ModelHash") == 0


def test_a_model_that_does_not_fit_is_refused_on_both_sides() -> None:
    with refused(InputError, expected=8, got=9):
        device_model(layered_texture(9), HELLO)
    with refused(InputError, expected="finite"):
        device_model(planted_texture("canvas"), HELLO, limits=Limits(peak=1.0))
    with refused(InputError, expected="4000 Hz", got="5000 Hz"):
        device_model(planted_texture("canvas"), Hello(29012, (1, 0), 0, 4000.0, 8, 0))
    talk = Talk()
    with pytest.raises(DeviceRefused) as told:
        talk.upload(bytes(16_385), 0)
    assert told.value.status == DeviceStatus.TOO_LARGE
