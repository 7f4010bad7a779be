"""tactileq record --recorder: on a recorder in virtual time, and on an emulated one in a process.

All recorders here are simulated.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.analysis.textures.between import halfway, truth_summary
from tactileq.modeling import RecordingSet, fit_texture
from tactileq.modeling.files.tables import read_cells
from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.recorder.machine import SURFACE_RECORDER
from tactileq.rig.machines.recorder.recorder_file import SHIPPED_RECORDER_FILE, RecorderFile
from tactileq.rig.machines.recorder.store import RECORDER_COLUMNS, TABLE_NAME
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.stimuli.planted.textures import (
    FORCES_N,
    RECORDER_RATE_HZ,
    SPEEDS_MM_S,
    PlantedSurface,
    planted_texture,
    record_texture,
)
from tests.refusals import check_refusal

GRID = """
speeds_mm_s = [100, 200]
forces_n = [1, 2]
"""
COLD = """
version = 1
[recorder]
name = "bench {name}"
address = "{address}"
simulated = true
[sample]
run_in_s = 0.05
"""


def conditions_of(folder: Path) -> list[tuple[float, float]]:
    return [record.condition for record in RecordingSet.load(folder)]


def test_a_simulated_recorder_records_the_whole_grid(main: Any, tmp_path: Path) -> None:
    """What is modelled from it is what is modelled from records in silico, within 0.1 dB."""
    made = main("record", "canvas", "--recorder", "simulated", "--texture", "canvas")
    assert made.returncode == 0, made.stderr
    assert "49 of 49 conditions" in made.stdout
    assert "simulated" in made.stdout
    records = RecordingSet.load(tmp_path / "canvas")
    assert all(record.simulated for record in records)
    on_recorder, in_silico = (
        truth_summary(
            fit_texture(one).peq,
            PlantedSurface("canvas"),
            halfway(SPEEDS_MM_S.tolist(), FORCES_N.tolist()),
            frequency_hz=np.arange(20.0, 1000.0, 5.0),
        )
        for one in (records, record_texture(planted_texture("canvas", rate_hz=RECORDER_RATE_HZ)))
    )
    assert all(found < direct + 0.1 for found, direct in zip(on_recorder, in_silico, strict=True))
    again = main("record", "canvas", "--recorder", "simulated", "--texture", "canvas")
    assert "0 of them in this run" in again.stdout


@pytest.mark.parametrize(
    ("options", "facts"),
    [
        (("--texture", "oak"), {"names": ["oak", "canvas"]}),
        (("--texture", "canvas", "--audio"), {"names": "--audio"}),
        (("--texture", "canvas", "--rig", "rig.toml"), {"names": "--rig"}),
        (("--texture", "canvas", "--grid", "strong.toml"), {"names": "N", "got": "9"}),
        (("--texture", "canvas", "--grid", "none.toml"), {"names": "none.toml"}),
    ],
)
def test_what_cannot_be_recorded_is_refused(
    main: Any, tmp_path: Path, options: tuple[str, ...], facts: dict[str, Any]
) -> None:
    (tmp_path / "strong.toml").write_text(GRID.replace("2]\n", "9]\n"))
    refused = main("record", "out", "--recorder", "simulated", *options)
    assert refused.returncode != 0
    check_refusal(refused.stderr.splitlines()[-1].removeprefix("error: "), **facts)
    assert not (tmp_path / "out").exists()


def test_a_plan_does_not_go_on_under_another_seed(main: Any, tmp_path: Path) -> None:
    (tmp_path / "grid.toml").write_text(GRID)
    words = ("record", "out", "--recorder", "simulated", "--texture", "canvas", "--duration", 0.4)
    words = (*words, "--grid", "grid.toml", "--seed")
    assert main(*words, 5).returncode == 0
    before = {path: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    refused = main(*words, 6)
    assert refused.returncode != 0
    check_refusal(refused.stderr, names="canvas", expected="--seed 5", got=6)
    assert {path: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert "0 of them in this run" in main(*words, 5).stdout


@pytest.mark.parametrize("where", ["address", "simulated"])
@pytest.mark.parametrize(
    ("sensor", "name"),
    [('files = "adcm"', "sensor.files"), ('device = "USB"', "sensor.device")],
)
def test_a_sensor_of_a_simulated_recorder_is_refused(
    main: Any, tmp_path: Path, where: str, sensor: str, name: str
) -> None:
    text = COLD.format(name="a", address="simulated" if where == "address" else "socket://h:1")
    text = text.replace("simulated = true\n", "" if where == "address" else "simulated = true\n")
    scale = 'g_per_fullscale = { value = 1, unit = "g", assumed = true, source = "a guess" }'
    (tmp_path / "recorder.toml").write_text(f"{text}[sensor]\n{sensor}\n{scale}\n")
    refused = main("record", "out", "--recorder", "recorder.toml", "--texture", "oak")
    assert refused.returncode != 0
    check_refusal(refused.stderr, names="recorder.toml", expected=[name, "simulated"], got="both")


def test_the_shipped_file_is_the_default_law() -> None:
    from tactileq.rig.machines.recorder.law import RecorderLaw

    assert RecorderFile.load(SHIPPED_RECORDER_FILE).law() == RecorderLaw()


@pytest.mark.long("a recorder that is killed, in real time; in virtual time: test_recording")
@pytest.mark.timeout(120)
@pytest.mark.usefixtures("given_clock")
def test_a_killed_computer_goes_on_with_what_is_missing(main: Any, tmp_path: Path) -> None:
    """The recorder, a process of its own, lets go and takes the next host."""
    (tmp_path / "grid.toml").write_text(GRID.replace("100, 200", "200"))
    words = ("record", "canvas", "--recorder", "recorder.toml", "--texture", "canvas")
    # A whole turn of the table: of a part of it the mean force depends on where it begins.
    words = (*words, "--duration", "1.3", "--grid", "grid.toml")
    with Emulator("process", SURFACE_RECORDER) as emulator:
        (tmp_path / "recorder.toml").write_text(
            COLD.format(name=tmp_path.name, address=emulator.address)
        )
        first = subprocess.Popen([sys.executable, "-m", "tactileq", *words], cwd=tmp_path)
        end_s = now_s() + 60
        while not (tmp_path / "canvas" / TABLE_NAME).exists():
            assert first.poll() is None
            assert now_s() < end_s
            sleep(0.02)
        sleep(0.5)
        first.send_signal(signal.SIGKILL)
        first.wait()
        asked = main("rig", "device", emulator.address)
        assert "tactileq-recorder" in asked.stdout
        assert "state FAILS" in asked.stdout
        before = (tmp_path / "canvas/0001.csv").read_bytes()
        second = main(*words)
    assert second.returncode == 0, second.stderr
    assert "1 of them in this run" in second.stdout
    assert conditions_of(tmp_path / "canvas") == [(200.0, 1.0), (200.0, 2.0)]
    assert (tmp_path / "canvas/0001.csv").read_bytes() == before
    rows = read_cells(tmp_path / "canvas" / TABLE_NAME, RECORDER_COLUMNS)
    assert [float(row["true_force_n"]) for _, row in rows] == pytest.approx([1, 2], rel=0.03)


def test_an_emulated_recorder_is_not_taken_for_a_real_one(main: Any, tmp_path: Path) -> None:
    with Emulator("process", SURFACE_RECORDER) as emulator:
        text = COLD.format(name=tmp_path.name, address=emulator.address)
        (tmp_path / "recorder.toml").write_text(text.replace("simulated = true\n", ""))
        refused = main("record", "out", "--recorder", "recorder.toml", "--texture", "oak")
    assert refused.returncode != 0
    check_refusal(
        refused.stderr.removeprefix("error: "), names="recorder.simulated", got="emulated"
    )
    assert not (tmp_path / "out").exists()
