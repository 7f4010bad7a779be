"""What `tactileq rig check` says of a machine, in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tactileq.app import app
from tactileq.rig.desk import inventory
from tactileq.rig.devices.sound import devices
from tests.rig.desk.rig_files import rig_text


def test_without_portaudio_one_sentence_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sentence = "expected the sound library PortAudio, got none; install it."

    def none() -> Any:
        raise devices.NoPortAudio(sentence)

    for module in (inventory, devices):
        monkeypatch.setattr(module, "portaudio", none)
    monkeypatch.setenv("COLUMNS", "250")
    file = tmp_path / "rig.toml"
    accelerometer = (
        '[accelerometer]\nrate_hz = 48000\ng_per_fullscale = { value = 20.0, unit = "g", '
        'assumed = true, source = "chosen" }\n'
    )
    file.write_text(rig_text(tmp_path) + accelerometer)
    done = CliRunner().invoke(app, ["rig", "check", "--rig", str(file)])
    assert done.exit_code == 1
    assert done.output.count(sentence) == 1
    assert f"no study can run: PortAudio: {sentence}" in done.output
    assert done.output.count("no study can run") == 1
    # Where the limits of the rig are shown: the window's weights are exponential.
    assert "2 g running RMS, exponential window of 1 s" in done.output
