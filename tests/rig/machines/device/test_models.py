"""Models on the device: the host's samples, bit for bit, and what is refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from tactileq.benches.rendering.rivals import layered_texture
from tactileq.modeling import InputError, Limits, Renderer, TextureModel
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.rig.machines.device.models import (
    DEVICE_LIMITS,
    UPLOAD_RANGES,
    DeviceModel,
    device_model,
)
from tactileq.rig.machines.device.registers import DeviceModelFault, DeviceSource, DeviceStatus
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
    with pytest.raises(DeviceRefused, match="hash") as told:
        talk.upload(good.data, good.hash ^ 1)
    assert told.value.status == DeviceStatus.MODEL
    assert talk.number("ModelFault") == DeviceModelFault.HASH
    assert talk.number("ModelHash") == 0


# Of one layer on a grid of 2 x 2 speeds and forces, as the page says.
SMALL = struct.pack(
    "<4s4B3I4x36d",
    *(b"TQM1", 8, 1, 2, 2, 5, 300_000, 500),
    *(5000, 10, 0.1, 0.5, 50, 50, 5, 4, 0.001, 1e-3, 240, 90, 0.5),
    *(50, 200, 0.5, 2, 1, 0.01, 0.01),
    *(4 * (0.1, 300, 50, 0.2)),
)
REALS = [*UPLOAD_RANGES][[*UPLOAD_RANGES].index("model_rate_hz") :]
PLACES = {**{name: n for n, name in enumerate(REALS[:13])}, "speed_mm_s": 14, "force_n": 16}
PLACES |= {"signs": 17, "slews": 18, "values": 23}


def fault_of(data: bytes) -> DeviceModelFault:
    """What a device has against an upload."""
    talk, status = Talk(), DeviceStatus.OK
    try:
        talk.upload(data, DeviceModel(data).hash)
    except DeviceRefused as refusal:
        status = DeviceStatus(refusal.status)
    fault = DeviceModelFault(talk.number("ModelFault"))
    assert status == (DeviceStatus.MODEL if fault else DeviceStatus.OK)
    assert (talk.number("ModelHash") != 0) == (fault == DeviceModelFault.NONE)
    return fault


def with_real(name: str, value: float) -> bytes:
    """Of an axis a small number is its first, and any other its last."""
    at = 24 + 8 * (PLACES[name] - (name in ("speed_mm_s", "force_n") and value < 0.1))
    return SMALL[:at] + struct.pack("<d", value) + SMALL[at + 8 :]


@pytest.mark.parametrize("name", REALS)
def test_every_real_is_refused_outside_the_range_of_the_page_and_by_its_name(name: str) -> None:
    of = UPLOAD_RANGES[name]
    refusal = DeviceModelFault[name.upper()]
    lowest, highest = float(of.low), float(of.high)
    least = np.nextafter(lowest, np.inf) if of.above else lowest
    most = np.nextafter(highest, -np.inf) if of.below else highest
    for value in (least, most):
        assert fault_of(with_real(name, value)) == DeviceModelFault.NONE, value
    beyond = [np.nextafter(least, -np.inf), np.nextafter(most, np.inf), np.nan, np.inf, -np.inf]
    for value in beyond:
        assert fault_of(with_real(name, value)) == refusal, value


@pytest.mark.parametrize(
    ("at", "form", "value", "name"),
    [
        (0, "4s", b"TQM2", "HEAD"),
        (4, "B", 4, "HEAD"),
        (5, "B", 9, "LAYERS"),
        (6, "B", 1, "GRID"),
        (7, "B", 1, "GRID"),
        (7, "B", 3, "SIZE"),
        (8, "I", 0, "UPDATE_SAMPLES"),
        (8, "I", 1000, "NONE"),
        (8, "I", 1001, "UPDATE_SAMPLES"),
        (12, "I", 0, "LONGEST"),
        (16, "I", 0, "PAUSE"),
        (16, "I", 1, "NONE"),
    ],
)
def test_a_head_is_refused_by_its_part(at: int, form: str, value: object, name: str) -> None:
    part = struct.pack(f"<{form}", value)
    data = SMALL[:at] + part + SMALL[at + len(part) :]
    assert fault_of(data) == DeviceModelFault[name]


def test_what_ranges_alone_do_not_say_is_refused() -> None:
    assert fault_of(SMALL[:20]) == DeviceModelFault.SIZE
    rest = 24 + 8 * 20  # noise gain, frequency, bandwidth, gain
    for place, value in ((0, -1e-9), (0, 1000.1), (1, 1e6 + 1), (2, np.nan), (3, -1000.1)):
        at = rest + 8 * place
        data = SMALL[:at] + struct.pack("<d", value) + SMALL[at + 8 :]
        assert fault_of(data) == DeviceModelFault.VALUES
    assert fault_of(with_real("speed_mm_s", struct.unpack_from("<d", SMALL, 24 + 8 * 13)[0])) == (
        DeviceModelFault.SPEED_MM_S
    )
    without = SMALL[: 24 + 80] + struct.pack("<3d", 0, 0, 0) + SMALL[24 + 104 :]
    assert fault_of(without) == DeviceModelFault.NONE


def test_the_ranges_have_the_names_of_the_faults() -> None:
    named = [fault.name.lower() for fault in DeviceModelFault]
    assert [name for name in named if name in UPLOAD_RANGES] == list(UPLOAD_RANGES)
    assert set(named) - set(UPLOAD_RANGES) == {"none", "hash", "head", "size"}


@pytest.mark.parametrize(
    ("limits", "facts"),
    [(Limits(peak=50, rms=2, duration_s=60), ["peak", "50"]), (None, ["notch_hz", "2400"])],
)
def test_the_host_sends_nothing_that_the_device_refuses(
    limits: Limits | None, facts: list[str]
) -> None:
    low = Compensation(rate_hz=5000.0, frequency_hz=2400.0, bandwidth_hz=90.0, height=3.0)
    options = {"limits": limits} if limits else {"compensation": low}
    with refused(InputError, expected=facts[0], got=facts[1]):
        device_model(planted_texture("canvas"), HELLO, **options)  # type: ignore[arg-type]


def test_a_model_is_no_source_before_there_is_one() -> None:
    talk = Talk()
    with pytest.raises(DeviceRefused) as told:
        talk.write("Source", DeviceSource.MODEL)
    assert told.value.status == DeviceStatus.STATE
    assert talk.read("Source") == DeviceSource.NOTHING
    talk.write("Source", DeviceSource.HOST)
    good = device_model(planted_texture("canvas"), HELLO)
    talk.upload(good.data, good.hash)
    assert talk.write("Source", DeviceSource.MODEL) == DeviceSource.MODEL


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
