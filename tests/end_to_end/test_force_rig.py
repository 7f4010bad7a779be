"""The commands on a force device: check, pose, stiffness, and a session with a wall.

The device is the stand-in, so everything here is simulated.
"""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.store.exposure import exposed_g2_s
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling.vibrators.exposure import daily_exposure_m_s2
from tactileq.rig.machines.force.standin import StandIn, library_path
from tactileq.rig.machines.force.states import State
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.setup.rig_file import RigFile
from tests.end_to_end.test_session_on_a_rig import (
    STUDY,
    WORDS,
    Unlucky,
    sit_down,
    study,  # noqa: F401 (a fixture)
)
from tests.rig.machines.force.rig_files import force_rig, standing_in
from tests.rig.waiting import follow, wait_until

WALL = """
[wall]
width_mm = 70
stiffness_n_per_mm = 0.5
[[wall.under]]
texture = "PVC"
stiffness_n_per_mm = 0.8
"""


@pytest.fixture
def force_device(
    given_clock: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[StandIn]:
    with standing_in(tmp_path, monkeypatch) as made:
        yield made


def test_the_check_says_what_no_hardware_has_confirmed(
    main: Any, tmp_path: Path, force_device: StandIn
) -> None:
    force_rig(tmp_path)
    said = main("rig", "check").stdout
    assert "libdhd 3.17: simulated" in said
    assert "passive up to 1 N/mm" in said
    # Under any other name the same library is taken for the maker's.
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "path.toml").write_text(text.replace('"stand-in"', f'"{library_path()}"'))
    assert "libdhd 3.17: untested on hardware" in main("rig", "check", "--rig", "path.toml").stdout
    force_device.fields.devices = 0
    done = main("rig", "check")
    assert done.returncode == 1
    assert "expected a force device, got none" in " ".join(done.stdout.split())


@pytest.mark.long("a whole measurement in real time")
def test_the_stiffness_of_the_real_surface_is_found_and_the_wall_made_as_stiff(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.desk.calibration.stiffness.PRESS_S", 1.5)
    monkeypatch.setattr("tactileq.rig.machines.force.standin.CARRIED_S", 0.7)
    force_device.fields.real_stiffness = 700.0
    file = force_rig(tmp_path).path
    done = main("rig", "stiffness", "--picture", "stiffness.png")
    assert done.returncode == 0, done.stderr
    found = RigFile.load(file).real_surface.stiffness
    assert found is not None
    assert found.value == pytest.approx(0.7, rel=0.03)
    assert "simulated" in found.source
    virtual = float(done.stdout.split("virtual wall: ")[1].split()[0])
    assert virtual == pytest.approx(found.value, rel=0.05)
    assert (tmp_path / "stiffness.png").read_bytes().startswith(b"\x89PNG")
    assert max(abs(force) for force in force_device.fields.force) == 0


def test_a_surface_that_does_not_give_way_is_no_spring(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.desk.calibration.stiffness.PRESS_S", 1.5)
    monkeypatch.setattr("tactileq.rig.machines.force.standin.CARRIED_S", 0.7)
    force_device.fields.real_stiffness = 1e5
    before = force_rig(tmp_path).path.read_text()
    done = main("rig", "stiffness")
    assert done.returncode == 1
    assert "expected a surface that gives way like a spring" in done.stderr
    assert (tmp_path / "rig.toml").read_text() == before


@pytest.mark.long("a whole measurement in real time")
def test_a_virtual_wall_beside_a_real_surface_is_not_taken_for_as_stiff(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.desk.calibration.stiffness.PRESS_S", 1.5)
    monkeypatch.setattr("tactileq.rig.machines.force.standin.CARRIED_S", 0.7)
    let_go = StandIn.let_go
    monkeypatch.setattr(StandIn, "let_go", lambda self, *, on_real: let_go(self, on_real=True))
    before = force_rig(tmp_path).path.read_text()
    done = main("rig", "stiffness", "--picture", "stiffness.png")
    assert done.returncode == 1
    told = " ".join(done.stderr.split())
    assert re.search(r"expected about 0\.99\d N/mm .*got (1\.9\d|2) N/mm", told)
    assert (tmp_path / "rig.toml").read_text() == before
    assert not (tmp_path / "stiffness.png").exists()


@pytest.mark.long("a whole measurement in real time")
def test_the_damping_of_the_device_is_found_and_its_least_written(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.machines.force.standin.CARRIED_S", 0.7)
    force_device.fields.friction = 1.3
    file = force_rig(tmp_path).path
    done = main("rig", "damping")
    assert done.returncode == 0, done.stderr
    assert re.search(r"^mass: 0\.(20|199)", done.stdout, flags=re.MULTILINE)
    device = RigFile.load(file).force_device
    assert device is not None
    assert 0.9 * 1.3 <= device.damping.value <= 1.3
    assert not device.damping.assumed
    assert "commanded" in device.damping.source
    assert "simulated" in device.damping.source
    assert force_device.fields.most_n <= 1.0
    assert max(abs(force) for force in force_device.fields.force) == 0


@pytest.mark.long("a whole measurement in real time")
def test_a_tool_that_is_held_shows_no_damping_of_the_device(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.desk.calibration.damping.RUNS", 4)
    monkeypatch.setattr(StandIn, "let_go", lambda *_, **__: None)
    force_device.fields.stroke = 0.0
    before = force_rig(tmp_path).path.read_text()
    done = main("rig", "damping")
    assert done.returncode == 1
    assert "let go of the tool" in " ".join(done.stderr.split())
    assert (tmp_path / "rig.toml").read_text() == before
    assert max(abs(force) for force in force_device.fields.force) == 0


def test_a_pose_is_written_from_three_points(
    main: Any, tmp_path: Path, force_device: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    import typer

    force_rig(tmp_path)
    places = [(-0.02, -0.01), (0.03, -0.01), (-0.02, 0.04)]

    def go(*_: object, **__: object) -> str:
        one = force_device.fields
        one.hand_stiffness, one.stroke, one.press = 60.0, 0.0, -0.02  # lifted
        sleep(0.3)
        one.rest = places.pop(0)
        sleep(0.3)
        one.press = 0.005
        sleep(0.6)
        return ""

    monkeypatch.setattr(typer, "prompt", go)
    done = main("rig", "pose")
    assert done.returncode == 0, done.stderr
    pose = RigFile.load(tmp_path / "rig.toml").pose
    assert pose is not None
    assert pose.origin_mm == pytest.approx((-20.0, -10.0, -5.0), abs=0.3)
    assert pose.x == pytest.approx((1, 0, 0), abs=0.01)
    assert pose.z == pytest.approx((0, 0, 1), abs=0.01)


def press_down(parts: Any) -> None:
    """Until the hand has pressed on all of the wall; not where a busy machine was late, so that the
    device has let go."""

    def presses() -> bool:
        parts.live.heartbeat()
        let_go = parts.reader.status.state != State.RUNNING
        return bool(let_go or parts.live.latest()["force_n"] > 0.5)

    wait_until(presses, seconds=3)
    follow(0.3, parts.live.heartbeat)


def kill_the_servo(parts: Any) -> None:
    press_down(parts)
    pid = parts.reader.pid
    os.kill(pid, signal.SIGKILL)

    def is_replaced() -> bool:
        parts.live.heartbeat()
        return bool(parts.reader.pid != pid and parts.reader.status.state != State.BOOT)

    wait_until(is_replaced)


def test_a_session_with_a_wall_stores_it_and_goes_on_after_a_lost_servo(
    main: Any,
    study: Path,  # noqa: F811
    force_device: StandIn,
    jack_server: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    force_rig(study)
    (study / "study.toml").write_text(STUDY + WALL)

    def leave(parts: Any) -> None:
        press_down(parts)
        force_device.fields.stroke = 0.06
        follow(0.8, parts.live.heartbeat)

    happens = {1: press_down, 2: kill_the_servo, 3: press_down, 4: press_down, 5: leave}
    someone = Unlucky(happens)
    experimenter = sit_down(monkeypatch, someone)
    with jack_server(block=128):
        done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 0, done.stderr
    assert experimenter.called
    stem = study / "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute"
    answers = pd.read_csv(
        study / "data/sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh.tsv", sep="\t"
    )
    failed = set(answers.loc[answers["valid"] == 0, "trial"])
    assert 2 in failed
    assert {2} <= set(answers["repeats"].dropna().astype(int))  # armed again: it was repeated
    events = read_log(Path(f"{stem}_log.jsonl")).events
    told = " ".join(event["told"] for event in events if event["event"] == "fault")
    assert "stood still and was killed" in told
    hand = pd.read_csv(f"{stem}_hand.tsv", sep="\t")
    fine = hand[(hand["surface"] == "virtual") & ~hand["trial"].isin(failed)]
    on_wall = fine[fine["force_n"] > 0.3]
    assert len(on_wall) > 300
    assert (on_wall["force_commanded"] == 1).all()
    ratio = on_wall["force_n"] / on_wall["depth_mm"]
    textures = on_wall["trial"].map(dict(zip(answers["trial"], answers["texture"], strict=True)))
    for texture, stiffness in (("MDF", 0.5), ("PVC", 0.8)):
        # The wall ramps in where it is switched on under the hand.
        found = np.quantile(ratio[textures == texture], 0.9)
        assert found == pytest.approx(stiffness, rel=0.05)
    assert hand.loc[hand["surface"] == "real", "force_n"].isna().all()
    assert hand["beyond_edge"].sum() > 0  # strokes of 120 mm on a wall of 70 mm
    outside = [event for event in events if event["event"] == "outside"]
    assert "strokes.beyond_edge" in {event["advice"] for event in outside}
    sidecar = next((study / "data/sub-01/ses-01/beh").glob("*_physio.json")).read_text()
    assert "commanded" in sidecar
    (manifest,) = (study / "data/sourcedata").rglob("*_manifest.json")
    walls = SessionManifest.load(manifest).rig["Walls"]
    assert walls["the wall under PVC"]["stiffness_n_per_mm"] == 0.8
    assert verify_data(study / "data").differences == ()
    check_exposure(study, events)


def check_exposure(study: Path, events: Any) -> None:  # noqa: F811
    from datetime import date

    exposures = [event for event in events if event["event"] == "exposure"]
    total = sum(event["weighted_g2_s"] for event in exposures)
    assert total > 0
    assert exposures[-1]["a8_m_s2"] == pytest.approx(daily_exposure_m_s2(total))
    assert exposed_g2_s(study / "data", 1, on=date.today()) == pytest.approx(total)
    assert exposed_g2_s(study / "data", 2, on=date.today()) == 0
    assert exposed_g2_s(study / "data", 1, on=date(2020, 1, 1)) == 0


@pytest.mark.parametrize(
    ("wall", "told"),
    [
        ("stiffness_n_per_mm = 3", "at most 1 N/mm holds"),
        ("height_mm = 150", "a corner at z = 150 mm"),
        ("width_mm = 300", "a corner at x = -150 mm"),
        ("damping_n_s_per_m = 5", "the device's own 2 N·s/m"),
    ],
)
def test_a_wall_that_the_device_cannot_render_is_refused_before_anything_is_written(
    main: Any,
    study: Path,  # noqa: F811
    force_device: StandIn,
    wall: str,
    told: str,
) -> None:
    force_rig(study)
    (study / "study.toml").write_text(f"{STUDY}[wall]\n{wall}\n")
    done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 1
    assert told in done.stderr
    assert not (study / "data").exists()


def test_a_wall_without_a_device_and_a_pose_older_than_its_home_are_refused(
    main: Any,
    study: Path,  # noqa: F811
    force_device: StandIn,
) -> None:
    (study / "study.toml").write_text(f"{STUDY}[wall]\n")
    done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 1
    assert "expected a force device for a wall" in done.stderr
    pose = "[pose]\norigin_mm = [0,0,0]\nx = [1,0,0]\nz = [0,0,1]\nmeasured_on = 2026-11-01\n"
    text = force_rig(study).path.read_text()
    text = text.replace('library = "stand-in"', 'library = "stand-in"\nhomed_on = 2026-11-02')
    (study / "rig.toml").write_text(text.replace("[latency]", f"{pose}[latency]"))
    done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 1
    assert "homed on 2026-11-02, got one of 2026-11-01" in done.stderr
