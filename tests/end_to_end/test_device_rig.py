"""The commands on a device that renders by itself: check, and a session with its wall.

The device is emulated, so everything here is simulated.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.verification.verifying import verify_data
from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.stimuli.planted.textures import planted_texture
from tests.end_to_end.test_force_rig import press_down
from tests.end_to_end.test_session_on_a_rig import (
    STUDY,
    WORDS,
    Unlucky,
    sit_down,
    study,  # noqa: F401 (a fixture)
)
from tests.rig.machines.device.test_in_a_rig import device_rig
from tests.rig.machines.device.test_renders_in_a_rig import rendering_rig

WALL = """
[wall]
width_mm = 100
stiffness_n_per_mm = 0.8
"""


@pytest.fixture
def device(given_clock: None) -> Iterator[Emulator]:
    with Emulator("process", CABLE_DEVICE) as emulator:
        yield emulator


def test_the_check_and_the_question_say_what_is_there(
    main: Any, tmp_path: Path, device: Emulator
) -> None:
    device_rig(tmp_path, device.address)
    said = " ".join(main("rig", "check").stdout.split())
    assert "tactileq-cables, firmware 1.2" in said
    assert "state IDLE, last cause NONE: simulated" in said
    assert "passive up to 1.67 N/mm" in said
    asked = main("rig", "device", device.address)
    assert asked.returncode == 0, asked.stderr
    assert "double precision, simulated" in asked.stdout
    device.close()
    done = main("rig", "check")
    assert done.returncode == 1
    assert "expected a serial port" in " ".join(done.stdout.split())


def test_a_session_runs_on_it_without_a_sound_card(
    main: Any,
    study: Path,  # noqa: F811
    device: Emulator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rendering_rig(study, device.address)
    (study / "study.toml").write_text(STUDY + WALL)
    sit_down(monkeypatch, Unlucky(dict.fromkeys(range(1, 5), press_down)))
    done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 0, done.stderr
    stem = study / "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute"
    hand = pd.read_csv(f"{stem}_hand.tsv", sep="\t")
    on_wall = hand[(hand["surface"] == "virtual") & (hand["force_n"] > 0.3)]
    assert len(on_wall) > 300
    assert (on_wall["force_commanded"] == 1).all()
    assert (on_wall["force_n"] / on_wall["depth_mm"]).quantile(0.9) == pytest.approx(0.8, rel=0.05)
    played = pd.read_csv(f"{stem}_presentations.tsv", sep="\t")
    virtual = played[played["surface"] == "virtual"]
    shown_s = virtual["end_s"] - virtual["start_s"]
    assert (virtual["played_s"] - shown_s).abs().max() < 0.15
    assert virtual["dose_g2_s"].max() > 0
    assert (virtual["stale_blocks"] == 0).all()
    events = read_log(Path(f"{stem}_log.jsonl")).events
    assert sum(event.get("weighted_g2_s", 0) for event in events) > 0
    assert verify_data(study / "data").differences == ()


def test_it_is_watched_and_played_by_commands(main: Any, tmp_path: Path, device: Emulator) -> None:
    rendering_rig(tmp_path, device.address)
    said = " ".join(main("rig", "check").stdout.split())
    assert "the device renders the texture" in said
    assert "A study can run on this rig." in said
    (tmp_path / "weak").mkdir()
    rendering_rig(
        tmp_path / "weak", device.address, ('= 2.0, unit = "V/g"', '= 0.0001, unit = "V/g"')
    )
    said = " ".join(main("rig", "check", "--rig", "weak/rig.toml").stdout.split())
    assert "no study can run: force device: expected a peak limit of at most" in said
    played = main("rig", "play", "--rig", "rig.toml", "--tone", "200", "--duration", "0.3")
    assert played.returncode == 0, played.stderr
    planted_texture("canvas").save(tmp_path / "canvas.json")
    watched = main("rig", "monitor", "canvas.json", "--seconds", "1")
    assert watched.returncode == 0, watched.stderr
    assert re.search(r"of \d\d+ blocks missed", watched.stdout)
    refused = main("rig", "latency")
    assert refused.returncode == 1
    assert "expected a rig whose sound card plays" in " ".join(refused.stderr.split())
