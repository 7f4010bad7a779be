"""tactileq feel: a real window and the sound process, on an audio server without a card."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from tactileq.rig.shared.live.compiled import CLOCK
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE
from tactileq.stimuli.planted.textures import planted_texture

Jack = Callable[..., AbstractContextManager[Any]]


@pytest.fixture
def models(tmp_path: Path) -> Path:
    planted_texture("canvas").save(tmp_path / "canvas.json")
    return tmp_path


def test_a_rig_is_felt_until_escape(models: Path, display: str, jack_server: Jack) -> None:
    text = SHIPPED_RIG_FILE.read_text(encoding="utf-8")
    text = text.replace('kind = "tablet"', 'kind = "scripted"')
    (models / "rig.toml").write_text(text.replace('"desk rig"', f'"{models}"'), encoding="utf-8")
    command = [sys.executable, "-m", "tactileq", "feel", "canvas.json", "--rig", "rig.toml"]
    with jack_server(block=128) as server:
        environment = {**server.environment, "DISPLAY": display}
        del environment[CLOCK]  # its card is no simulated one
        program = subprocess.Popen(command, cwd=models, env=environment, stderr=subprocess.PIPE)
        try:
            server.wait_for_port(":out_")
            xdotool = ["xdotool", "search", "--sync", "--name", "^tactileq$"]
            subprocess.run(xdotool, env=environment, check=True, timeout=500, capture_output=True)
            end = time.monotonic() + 500
            while program.poll() is None and time.monotonic() < end:
                keys = ["xdotool", "mousemove", "960", "540", "key", "Escape"]
                subprocess.run(keys, env=environment, timeout=500)  # the window may just close
                time.sleep(0.2)
            assert program.wait(500) == 0
        finally:
            program.kill()
            _, told = program.communicate(timeout=500)
        assert b"Traceback" not in told
        assert not [port for port in server.ports() if ":out_" in port]  # it left nothing behind


def test_what_cannot_be_shown_ends_in_one_sentence(models: Path, main: Any) -> None:
    def refusal(*words: str) -> str:
        done = main("feel", *words)
        assert done.returncode == 1
        return str(done.stderr)

    assert "expected a model file at nothing.json, got nothing there" in refusal("nothing.json")
    (models / "vibrator.json").write_text("{}")
    told = refusal("canvas.json", "--rig", "rig.toml", "--vibrator", "vibrator.json")
    assert told == (
        "error: expected the vibrator in the rig file rig.toml, got --vibrator beside it; name its "
        "file under [vibrator] there.\n"
    )
    assert "rig.toml" in refusal("canvas.json", "--rig", "rig.toml")


def test_without_a_screen_it_ends_in_one_sentence(models: Path) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, "-m", "tactileq", "feel", "canvas.json"],
        cwd=models,
        env=environment,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("error: expected a screen for the window, got ")
    assert done.stderr.count("\n") == 1
