"""The commands on a device that renders by itself: check, and a session with its wall.

The device is emulated, so everything here is simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from experiments.sessions.log import read_log
from experiments.verification.verifying import verify_data
from rig.device.emulating import Emulator
from tests.end_to_end.test_force_rig import press_down
from tests.end_to_end.test_session_on_a_rig import (
    STUDY,
    WORDS,
    Unlucky,
    sit_down,
    study,  # noqa: F401 (a fixture)
)
from tests.rig.device.test_in_a_rig import device_rig

WALL = """
[wall]
width_mm = 100
stiffness_n_per_mm = 0.8
"""


@pytest.fixture
def device() -> Iterator[Emulator]:
    with Emulator("process") as emulator:
        yield emulator


def test_the_check_and_the_question_say_what_is_there(
    main: Any, tmp_path: Path, device: Emulator
) -> None:
    device_rig(tmp_path, device.address)
    said = " ".join(main("rig", "check").stdout.split())
    assert "tactileq-cables, firmware 1.1" in said
    assert "state IDLE, last cause NONE: simulated" in said
    assert "passive up to 1.67 N/mm" in said
    asked = main("rig", "device", device.address)
    assert asked.returncode == 0, asked.stderr
    assert "double precision, simulated" in asked.stdout
    device.close()
    done = main("rig", "check")
    assert done.returncode == 1
    assert "expected a serial port" in " ".join(done.stdout.split())


def test_a_session_runs_on_it_unchanged(
    main: Any,
    study: Path,  # noqa: F811
    device: Emulator,
    jack_server: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    device_rig(study, device.address)
    (study / "study.toml").write_text(STUDY + WALL)
    sit_down(monkeypatch, Unlucky(dict.fromkeys(range(1, 5), press_down)))
    with jack_server(block=128):
        done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 0, done.stderr
    stem = study / "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute"
    hand = pd.read_csv(f"{stem}_hand.tsv", sep="\t")
    on_wall = hand[(hand["surface"] == "virtual") & (hand["force_n"] > 0.3)]
    assert len(on_wall) > 300
    assert (on_wall["force_commanded"] == 1).all()
    assert (on_wall["force_n"] / on_wall["depth_mm"]).quantile(0.9) == pytest.approx(0.8, rel=0.05)
    events = read_log(Path(f"{stem}_log.jsonl")).events
    assert any(event["event"] == "exposure" for event in events)
    assert verify_data(study / "data").differences == ()
