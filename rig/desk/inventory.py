"""The parts of a rig, and what is missing for a study.

Nothing is played or moved to find that out.
"""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import starmap
from math import log10
from pathlib import Path
from typing import Literal

from tactileq.modeling.errors import InputError, counted
from tactileq.modeling.extras import Extra, MissingExtra, install_advice
from tactileq.modeling.files.provenance import version_of
from tactileq.modeling.rendering.compiled import is_compiled
from tactileq.rig.desk.checks import Requirements, refusals
from tactileq.rig.desk.parts import force_settings, hand_settings
from tactileq.rig.desk.walls import largest_of
from tactileq.rig.devices.hand.devices import connected_devices
from tactileq.rig.devices.hand.sample import ConnectedDevice
from tactileq.rig.devices.sound.devices import (
    Direction,
    NoPortAudio,
    SoundDevice,
    check_rate,
    find_device,
    portaudio,
    sound_devices,
)
from tactileq.rig.machines.force.dhd import UNTESTED, DhdLibrary
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.states import Cause
from tactileq.rig.machines.force.wall import SLOW_FROM
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.force_sections import DeviceSection, ForceSection
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, RigFile
from tactileq.rig.shared.setup.sections import CALIBRATION_DAYS

State = Literal["ok", "note", "fault"]
PACKAGES: dict[str, Extra | None] = {
    **dict.fromkeys(("tactileq", "numpy", "scipy")),
    **dict.fromkeys(("sounddevice", "pyserial"), "rig"),
    "psychopy": "console",
}
GROUPS = {"tablet": "input", "mouse": "input", "serial": "dialout"}  # who may read, on Debian
SERVO_S = 0.5  # for which the servo of a force device runs without force
_WITHOUT_PORTAUDIO = "not known without PortAudio"  # which is a separate fault, reported once


@dataclass(frozen=True)
class Finding:
    """One item that was checked.

    Parameters
    ----------
    told : str
        What it is; where it is a fault or a note, what to do.
    state : {"ok", "note", "fault"}
        A note lowers what a study may claim; with a fault none can run.
    """

    name: str
    sentence: str
    state: State = "ok"


def versions() -> list[Finding]:
    """Programs and libraries, and whether the compiled parts are there."""
    found = [Finding("Python", f"{platform.python_version()}, {platform.platform(terse=True)}")]
    found += starmap(_package, PACKAGES.items())
    found.append(_tried("PortAudio", lambda: portaudio().get_portaudio_version()[1].split(",")[0]))
    rendering = Finding("rendering kernel", "compiled")
    if not is_compiled():
        sentence = "expected the compiled kernel, got none; install a C compiler, then tactileq."
        rendering = Finding("rendering kernel", sentence, "fault")
    return [*found, rendering, _tried("audio callback", lambda: str(compiled() and "compiled"))]


def _package(name: str, extra: Extra | None) -> Finding:
    version = version_of(name)
    if version is None:
        advice = f"pip install {name}" if extra is None else install_advice(extra)
        return Finding(name, f"expected {name}, got none; {advice}.", "note")
    return Finding(name, version)


def connected_sound() -> list[Finding]:
    """All sound devices: channels, usual rate. Whether a rig needs one is said with the rig."""
    try:
        devices = sound_devices()
    except (NoPortAudio, MissingExtra):
        return [Finding("sound", _WITHOUT_PORTAUDIO, "note")]
    except InputError as error:
        return [Finding("sound", str(error), "fault")]
    if not devices:
        sentence = "expected a sound device, got none; connect one, or start the sound server."
        return [Finding("sound", sentence, "note")]
    return [Finding(device.name, _described(device)) for device in devices]


def connected_input() -> list[Finding]:
    """What may measure a hand: pens, mice and the like on Linux, and serial ports."""
    return [_input_device(device) for device in connected_devices()]


def of_rig(
    file: Path,
    *,
    today: datetime.date,
    refused_by: Callable[[RigFile], Mapping[str, str]] | None = None,
) -> tuple[RigFile | None, list[Finding]]:
    """The rig file, and what of it is there: sound, hand, accelerometer, calibration, latency.

    Parameters
    ----------
    refused_by : callable, optional
        Why sessions of a study refuse the rig, as `refusals`; by default of one that says nothing
        of rigs.
    """
    if not file.exists():
        sentence = (
            f"expected a rig file, got none; copy {SHIPPED_RIG_FILE} and adapt it to your rig."
        )
        return None, [Finding(str(file), sentence, "fault")]
    try:
        rig = RigFile.load(file)
    except InputError as error:
        return None, [Finding(str(file), str(error), "fault")]
    found = [
        Finding("rig", f"{rig.rig.name}{' (simulated)' if rig.simulated else ''}"),
        _sound(rig),
        _limits(rig),
        _hand(rig),
        *([] if rig.force_device is None else _force(rig, rig.force_device)),
        _accelerometer(rig),
        _calibration(rig, today),
        _latency(rig, today),
    ]
    assumed = rig.assumed()
    if assumed:
        sentence = (
            f"{len(assumed)} of {counted(len(rig.figures()), 'figure')} are assumed, see below"
        )
        found.append(Finding("figures", sentence, "note"))
    refused = (refused_by or partial(refusals, requirements=Requirements(), today=today))(rig)
    found = [one for one in found if one.state == "fault" or one.name not in refused]
    return rig, [*found, *(Finding(*told, "fault") for told in refused.items())]


def remedies(findings: Iterable[Finding]) -> list[str]:
    """One line each for a shell, to install what is missing on Debian and its like."""
    faults = " ".join(finding.sentence for finding in findings if finding.state == "fault")
    packages = [name for name in ("libportaudio2", "jackd2") if name in faults]
    lines = [f"sudo apt-get install {' '.join(packages)}"] if packages else []
    groups = [group for group in ("input", "dialout") if f"group {group}" in faults]
    if groups:
        lines.append(f'sudo usermod -aG {",".join(groups)} "$USER"   # then log in again')
    return lines


def _tried(name: str, version: Callable[[], str]) -> Finding:
    try:
        return Finding(name, version())
    except InputError as error:
        return Finding(name, str(error), "fault")


def _described(device: SoundDevice) -> str:
    return f"{device.host}: {device.inputs} in, {device.outputs} out, usually {device.rate_hz:g} Hz"


def _input_device(device: ConnectedDevice) -> Finding:
    sentence = f"{device.name}, {device.kind}"
    if device.readable:
        return Finding(device.path, sentence)
    needed = GROUPS.get(device.kind, "input")
    return Finding(device.path, f"{sentence}: not readable; it needs the group {needed}", "note")


def _sound(rig: RigFile) -> Finding:
    sound = rig.sound
    if rig.renderer is not None and sound.masking_channel is None:
        return Finding("sound", "not used: the device renders the texture, and nothing is masked")
    return _card("sound", sound.device, "output", rate_hz=sound.rate_hz, channels=sound.channels)


def _card(
    what: str, name: str | None, direction: Direction, *, rate_hz: float, channels: int
) -> Finding:
    try:
        device = find_device(name, direction, channels=channels)
        check_rate(device, direction, rate_hz=rate_hz, channels=channels)
    except (NoPortAudio, MissingExtra):
        return Finding(what, _WITHOUT_PORTAUDIO, "note")
    except InputError as error:
        return Finding(what, str(error), "fault")
    return Finding(
        what, f"{device.name} does {rate_hz:g} Hz with {channels} {direction} channel(s)"
    )


def _limits(rig: RigFile) -> Finding:
    limits = rig.safe_limits
    above_db = 20 * log10(limits.largest_rms(1.0) / limits.rms)
    return Finding(
        "limits",
        f"{limits.peak:g} g peak; {limits.rms:g} g running RMS, exponential window of "
        f"{limits.rms_window_s:g} s: after a silence up to {above_db:+.1f} dB over 1 s",
    )


def _force(rig: RigFile, force: ForceSection) -> list[Finding]:
    """The force device and its library, and what a wall on it may be."""
    stable = f"passive up to {largest_of(rig):.3g} N/mm"
    if rig.own_device is None:
        tolerated_ms = SLOW_FROM * 1e3 / force.rate_hz
        stable += f" at periods of up to {tolerated_ms:g} ms on average, above which it lets go"
    if force.damping.assumed or force.delay_ms.assumed:
        stable += ", on assumed damping or delay"
    found = [Finding("wall", f"{stable}; force is commanded, not sensed", "note")]
    if rig.own_device is not None:
        return [_device(rig, rig.own_device), *found]
    if rig.pose is None:
        sentence = "expected a measured pose, got none; measure it (tactileq rig pose)."
        found.append(Finding("pose", sentence, "note"))
    try:
        library = DhdLibrary(force.library)
        library.find(force.serial)
    except InputError as error:
        return [Finding("force device", str(error), "fault"), *found]
    version = ".".join(map(str, library.version[:2]))
    tested = "simulated" if library.simulated else UNTESTED
    return [
        Finding("force device", f"libdhd {version}: {tested}", "note"),
        _servo(rig, force),
        *found,
    ]


def _servo(rig: RigFile, force: ForceSection) -> Finding:
    """Which period the servo reaches; it runs for a while, without force."""
    settings = force_settings(rig, sounds=False)
    assert settings is not None
    most_ms = SLOW_FROM * 1e3 / force.rate_hz
    try:
        with (
            Live.create() as live,
            ForceHand(live, hand_settings(rig), replace(settings, watched=False)) as hand,
        ):
            sleep(SERVO_S)
            reached_ms, status = 1e3 * hand.control.longest_mean_s, hand.status
    except InputError as error:
        return Finding("servo", str(error), "fault")
    if status.cause:
        unread = status.cause in (Cause.NOT_READ, Cause.NOT_A_NUMBER)
        state: State = "fault" if unread else "note"
        return Finding("servo", status.sentence, state)
    reached = f"a period of {reached_ms:.2f} ms on average at worst over {SERVO_S:g} s"
    if reached_ms <= most_ms:
        return Finding("servo", f"{reached}; above {most_ms:g} ms it lets go")
    return Finding(
        "servo",
        f"expected at most {most_ms:g} ms, 1.5 times 1/force.rate_hz, got {reached}; close other "
        "programs, allow real-time priority, or lower force.rate_hz.",
        "note",
    )


def _device(rig: RigFile, section: DeviceSection) -> Finding:
    """What the device says of itself; saying hello lets go what another program had armed."""
    try:
        # They need the extra rig.
        from tactileq.rig.machines.device.asking import asked
        from tactileq.rig.machines.device.sound import check_reach

        found = asked(section.address, section.baud)
        if section.renders:
            check_reach(found.reach, rig.safe_limits, scale=rig.fullscale_per_g)
    except InputError as error:
        return Finding("force device", str(error), "fault")
    if found.simulated and not section.simulated:
        sentence = (
            "expected a board with a hand at [device], got an emulated one; set "
            "device.simulated = true, so that data say so."
        )
        return Finding("force device", sentence, "fault")
    tested = "simulated" if found.simulated else UNTESTED
    return Finding("force device", f"{found.name}, {found.state}: {tested}", "note")


def _hand(rig: RigFile) -> Finding:
    hand = rig.hand
    sentence = f"{hand.kind}{f', {hand.device}' if hand.device else ''}"
    if hand.kind in ("scripted", "window", "force"):
        return Finding("hand", sentence)
    if hand.device is not None and hand.device.startswith("/"):
        return _present("hand", Path(hand.device), sentence, group=GROUPS[hand.kind])
    wanted = [
        device
        for device in connected_devices()
        if device.kind == hand.kind
        and (hand.device in (None, device.path) or str(hand.device) in device.name)
    ]
    if not wanted:
        return Finding("hand", f"expected a {sentence}, got none; connect it.", "fault")
    if not any(device.readable for device in wanted):
        unread = _input_device(wanted[0])
        return Finding("hand", f"{unread.name} is {unread.sentence}.", "fault")
    return Finding("hand", sentence)


def _present(what: str, file: Path, sentence: str, *, group: str) -> Finding:
    if not file.exists():
        return Finding(what, f"expected {file}, got no such device; connect it.", "fault")
    if not os.access(file, os.R_OK):
        sentence = f"expected to read {file}, got no permission; join the group {group}."
        return Finding(what, sentence, "fault")
    return Finding(what, sentence)


def _accelerometer(rig: RigFile) -> Finding:
    section = rig.accelerometer
    if section is None:
        sentence = "none under [accelerometer]: the rig cannot be calibrated"
        return Finding("accelerometer", sentence, "note")
    return _card(
        "accelerometer",
        section.device,
        "input",
        rate_hz=section.rate_hz,
        channels=section.channel,
    )


def _calibration(rig: RigFile, today: datetime.date) -> Finding:
    done = rig.calibration
    if done is None or rig.vibrator.g_per_volt.assumed:
        sentence = "levels are assumed (tactileq rig calibrate level)"
        return Finding("calibration", sentence, "note")
    aged = _aged("calibration", done.date, today)
    if done.rests_on is None:
        sentence = (
            f"{aged.sentence}; it does not say what it rests on, so changes of the rig since then "
            "go unnoticed (tactileq rig calibrate level)"
        )
        return Finding("calibration", sentence, "note")
    return aged


def _latency(rig: RigFile, today: datetime.date) -> Finding:
    done = rig.latency
    if done is None:
        return Finding("latency", "never measured (tactileq rig latency)", "note")
    sentence = f"median {done.median_ms.value:.1f} ms, 95 % within {done.p95_ms.value:.1f} ms"
    if done.measured_on is None:
        return Finding("latency", f"{sentence}, date unknown", "note")
    aged = _aged("latency", done.measured_on, today)
    return Finding("latency", f"{sentence}, {aged.sentence}", aged.state)


def _aged(what: str, day: datetime.date, today: datetime.date) -> Finding:
    days = (today - day).days
    ago = "today" if days == 0 else f"{days} days ago"
    return Finding(what, f"{day.isoformat()}, {ago}", "note" if days > CALIBRATION_DAYS else "ok")
