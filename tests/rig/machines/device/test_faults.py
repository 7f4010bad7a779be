"""What goes wrong with board and host, in virtual time, judged by the device's own clock."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.virtual import TICK_HZ, VirtualBoard, VirtualTransport
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.models import device_model
from tactileq.rig.machines.device.registers import (
    DeviceCause,
    DeviceCommand,
    DeviceSimulation,
    DeviceSource,
    DeviceState,
    DeviceStatus,
)
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.rig.shared.wire.conversation import Conversation, DeviceRefused
from tactileq.rig.shared.wire.transports import TransportLost
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused
from tests.rig.machines.device.talking import Talk, joined

RELEASE_TICKS = 100  # 20 ms
MOST_TICKS = {  # from what goes wrong to no current
    DeviceSimulation.STUCK: TICK_HZ // 2,
    DeviceSimulation.JUMP: RELEASE_TICKS + 2,
    DeviceSimulation.FLIPPED: TICK_HZ,
    DeviceSimulation.MOTOR: RELEASE_TICKS + 3,
    DeviceSimulation.UNPLUGGED: RELEASE_TICKS + 2,
}
CAUSES = {
    DeviceSimulation.STUCK: {DeviceCause.STUCK},
    DeviceSimulation.JUMP: {DeviceCause.JUMP},
    DeviceSimulation.FLIPPED: {DeviceCause.WORKSPACE, DeviceCause.SPEED},
    DeviceSimulation.MOTOR: {DeviceCause.NOT_WRITTEN},
    DeviceSimulation.UNPLUGGED: {DeviceCause.JUMP, DeviceCause.NOT_READ},
}


@pytest.mark.parametrize("what", MOST_TICKS)
def test_a_device_that_goes_wrong_lets_go_and_stays_so(what: DeviceSimulation) -> None:
    talk = Talk()
    talk.push()
    begun = talk.number("Tick")
    talk.spoil(what)
    if (
        what == DeviceSimulation.FLIPPED
    ):  # harmless until the hand leaves the wall: then it is pulled on
        talk.write("Stroke", (40.0, 0.5, 0.0))
    talk.run(1.2)
    assert talk.state == DeviceState.FAULT
    assert talk.cause in CAUSES[what]
    assert 0 < talk.number("ZeroTick") - begun <= MOST_TICKS[what]
    assert talk.read("Current") == (0.0, 0.0)
    assert talk.number("ShutdownError") == (1 if what == DeviceSimulation.MOTOR else 0)
    talk.spoil(DeviceSimulation.NONE)
    talk.run(0.5)
    assert talk.state == DeviceState.FAULT  # latched
    for command in (DeviceCommand.ARM, DeviceCommand.SHOW, DeviceCommand.HIDE):
        with pytest.raises(DeviceRefused) as told:
            talk.ask(command)
        assert told.value.status == DeviceStatus.STATE


def test_encoders_that_count_backwards_are_let_go_before_and_under_a_wall() -> None:
    talk = Talk()
    talk.spoil(DeviceSimulation.FLIPPED)
    for command in (DeviceCommand.HOME, DeviceCommand.ARM):
        talk.ask(command)
    talk.run(0.5)
    assert (talk.state, talk.cause) == (DeviceState.FAULT, DeviceCause.UNANSWERED)
    talk = Talk()
    talk.write("FrozenTime", 5.0)
    talk.write("Stroke", (0.0, 0.5, 16.0))
    talk.push()
    talk.spoil(DeviceSimulation.FLIPPED)
    talk.write("Stroke", (0.0, 0.5, 15.0))  # a little less, and the wall pushes it out to the end
    talk.run(2.5)
    assert (talk.state, talk.cause) == (DeviceState.FAULT, DeviceCause.PRESSED_THROUGH)
    assert talk.read("Current") == (0.0, 0.0)


def test_counters_that_wrap_are_no_fault() -> None:
    """Both are 100 counts before their end where the tool rests, and pass it at once."""
    talk = Talk()
    talk.spoil(DeviceSimulation.WRAPPED)
    talk.wire.step(2)
    talk.hello()
    talk.push()
    values = joined(talk.recorded(4.0))
    assert talk.state == DeviceState.RUNNING
    assert np.ptp(values["x_mm"]) > 70
    assert np.abs(np.diff(values["x_mm"])).max() < 0.2


def test_a_host_that_is_gone_is_noticed_after_a_tenth_of_a_second() -> None:
    talk = Talk()
    talk.push()
    talk.wire.step(TICK_HZ)
    with pytest.raises(DeviceRefused):
        talk.ask(DeviceCommand.HIDE)
    assert (talk.state, talk.cause) == (DeviceState.FAULT, DeviceCause.LINK)
    assert talk.number("FaultTick") - talk.number("HeardTick") == 501
    assert abs(talk.number("ZeroTick") - talk.number("FaultTick") - RELEASE_TICKS) <= 1


def test_a_control_loop_that_hangs_is_noticed_while_its_thread_lives() -> None:
    talk = Talk()
    talk.push()
    begun_s = talk.now_s()
    while talk.state == DeviceState.RUNNING:
        talk.wire.step(50)
    assert talk.cause == DeviceCause.HEARTBEAT
    assert talk.now_s() - begun_s == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("cause", [DeviceCause.HOST, DeviceCause.STOPPED])
def test_saying_hello_again_or_stop_lets_go_and_is_noted(cause: DeviceCause) -> None:
    talk = Talk()
    talk.push()
    begun = talk.number("Tick")
    if cause == DeviceCause.HOST:
        talk.hello()
    else:
        talk.ask(DeviceCommand.STOP)
    talk.wire.step(2 * RELEASE_TICKS)
    assert (talk.state, talk.cause) == (DeviceState.FAULT, cause)
    assert 0 <= talk.number("FaultTick") - begun < 10
    assert abs(talk.number("ZeroTick") - talk.number("FaultTick") - RELEASE_TICKS) <= 1


def test_a_second_host_cannot_command_what_the_first_one_armed() -> None:
    talk = Talk()
    talk.push()
    other = Conversation(talk.wire, DEVICE)
    with pytest.raises(TransportLost):
        other.write("Command", DeviceCommand.SHOW)  # without the nonce
    assert talk.number("Cause") == DeviceCause.NONE
    other.hello()
    with pytest.raises(TransportLost):
        talk.read("State")  # with numbers of before
    other.write("Heartbeat", 1)
    assert other.read("Cause") == DeviceCause.HOST


def test_a_brown_out_in_the_middle_of_an_upload_leaves_no_model() -> None:
    talk = Talk()
    model = device_model(planted_texture("canvas"), talk.hello())
    talk.upload(model.data, model.hash)
    assert talk.number("ModelHash") == model.hash
    sent = []

    def write(data: bytes) -> None:
        sent.append(data)
        if len(sent) == 20:
            talk.wire.board.lib.tq_virtual_start(talk.wire.board.address, 99, 0)
        VirtualTransport.write(talk.wire, data)

    talk.wire.write = write  # type: ignore[method-assign]
    with pytest.raises(TransportLost):
        talk.upload(model.data, model.hash)
    talk.hello()
    assert talk.number("ModelHash") == 0
    assert talk.state == DeviceState.IDLE
    with pytest.raises(DeviceRefused) as told:
        talk.ask(DeviceCommand.ARM)  # it has to be homed again
    assert told.value.status == DeviceStatus.STATE
    talk.upload(model.data, model.hash)
    assert talk.number("ModelHash") == model.hash


def test_a_device_that_was_restarted_is_not_armed_by_what_was_sent_before() -> None:
    talk = Talk()
    talk.push()
    talk.spoil(DeviceSimulation.BROWN_OUT)
    talk.wire.step(2)
    for name in ("Tick", "State"):
        with pytest.raises(TransportLost):
            talk.read(name)
    talk.hello()
    assert talk.state == DeviceState.IDLE
    assert talk.read("Current") == (0.0, 0.0)


def test_a_reader_that_stalls_loses_records_which_are_counted() -> None:
    talk = Talk()
    talk.push()
    talk.write("EventRate", TICK_HZ)
    talk.wire.step(400)
    lost = 0
    for _ in range(20):  # the host writes, and reads nothing
        talk.wire.step(400)
        talk.wire.write(b"\0")
    talk.listen(0.01)
    blocks = talk.blocks()
    talk.write("EventRate", 0)
    lost = talk.number("RecordsLost")
    assert lost > 1000
    kept = sum(block.values.size for block in blocks)
    assert talk.counts["missing"] <= lost
    assert kept > 300


@pytest.mark.parametrize(
    ("name", "value", "status"),
    [
        ("Wall", (0.0, 1.7, 0.0, 100.0, 50.0), DeviceStatus.RANGE),  # beyond StiffnessLimit
        ("Wall", (0.0, 0.5, 0.0006, 100.0, 50.0), DeviceStatus.RANGE),  # too damped to be passive
        ("Workspace", (10.0, -10.0, -60.0, -5.0), DeviceStatus.RANGE),
        ("EventRate", 3000, DeviceStatus.RANGE),  # divides no 5000
    ],
)
def test_what_the_device_cannot_do_is_refused(
    name: str, value: tuple[float, ...] | int, status: DeviceStatus
) -> None:
    talk = Talk()
    before = talk.read(name)
    with pytest.raises(DeviceRefused) as told:
        talk.write(name, value)
    assert told.value.status == status
    assert talk.read(name) == before


def test_limits_stay_while_force_is_allowed() -> None:
    talk = Talk()
    assert talk.write("ForceLimit", 2.5) == 2.5
    talk.push()
    with pytest.raises(DeviceRefused) as told:
        talk.write("ForceLimit", 20.0)
    assert told.value.status == DeviceStatus.STATE
    assert talk.read("ForceLimit") == 2.5


def test_records_beyond_the_baud_rate_are_refused() -> None:
    talk = Talk(VirtualBoard(compiled_device(), baud=115_200))
    assert talk.write("EventRate", 200) == 200
    with pytest.raises(DeviceRefused) as told:
        talk.write("EventRate", 1000)
    assert told.value.status == DeviceStatus.RANGE


def test_a_register_that_there_is_not_is_refused() -> None:
    talk = Talk()
    with refused(InputError, got="Colour"):
        talk.read("Colour")
    with pytest.raises(DeviceRefused) as told:
        talk.read("Command")
    assert told.value.status == DeviceStatus.ACCESS


def test_the_hosts_samples_are_played_in_order_and_their_end_is_seen() -> None:
    talk = Talk()
    ramp = np.linspace(0.04, 1.0, 25, dtype=np.float32)
    for part in range(8):
        talk.write("Samples", tuple(float(x) for x in (ramp + part)[:25] / 10))
    assert talk.number("SamplesQueued") == 200
    values = joined(talk.recorded(0.1, source=DeviceSource.HOST))
    played = values["vibration_g"]
    first = np.flatnonzero(played)[0]
    expected = np.concatenate([(ramp + part) / 10 for part in range(8)]).astype(np.float32)
    # Those of the ticks before the first record are not in it.
    missing = int(np.argmin(np.abs(expected - played[first])))
    assert np.array_equal(played[first : first + 200 - missing], expected[missing:])
    after = played[first + 200 - missing :]
    assert after[0] == pytest.approx(0.9 * expected[-1], rel=1e-6)
    assert np.all(np.diff(after) <= 0)
    assert talk.number("SamplesMissed") > 50
    for _ in range(40):
        talk.write("Samples", tuple(0.0 for _ in ramp))
        if talk.number("SamplesQueued") > 900:
            break
