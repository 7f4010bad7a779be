"""Commands without the extra that they need: one sentence says which, and nothing is written."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.desk.rig_files import rig_file

Run = Callable[..., subprocess.CompletedProcess[str]]
Lack = Callable[[str], None]
ACCELEROMETER = """[accelerometer]
device = "system"
rate_hz = 48000
channel = 1
g_per_fullscale = { value = 16.0, unit = "g", assumed = false, source = "shaker" }
"""
SOUND = ("sounddevice", "rig")
SESSION = ("session", "--task", "absolute", "--study", "study.toml", "--models", "models")
COMMANDS = {
    "session": ([*SESSION, "--simplified", "other"], "psychopy", "console"),
    "feel": (["feel", "models/canvas.json"], "psychopy", "console"),
    "play": (["rig", "play", "--rig", "rig.toml", "--tone", "250"], *SOUND),
    "monitor": (["rig", "monitor", "models/canvas.json", "--rig", "rig.toml"], *SOUND),
    "latency": (["rig", "latency", "--rig", "rig.toml"], *SOUND),
    "calibrate": (["rig", "calibrate", "level", "--rig", "rig.toml"], *SOUND),
    "twin": (["rig", "twin", "--rig", "twin.toml"], *SOUND),
    "record": (
        [
            *("record", "oak", "--audio", "--texture", "oak", "--rig", "rig.toml"),
            *("--g-per-fullscale", "16"),
        ],
        *SOUND,
    ),
    "serial": (["rig", "range", "--rig", "serial.toml"], "serial", "rig"),
    "chart": (["bench", "chart", "--out", "chart"], "plotly", "chart"),
}


@pytest.fixture
def lack(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Lack:
    """`lack("serial")`: neither this process nor those that it starts can import it."""

    def hide(module: str) -> None:
        place = tmp_path_factory.mktemp("hidden")
        missing = f"raise ModuleNotFoundError('none', name={module!r})\n"
        (place / f"{module}.py").write_text(missing)
        monkeypatch.setenv("PYTHONPATH", str(place))
        for name in [name for name in sys.modules if name.split(".")[0] == module]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setitem(sys.modules, module, None)
        monkeypatch.delitem(sys.modules, "tactileq.rig.devices.hand.serial_sensor", raising=False)

    return hide


@pytest.mark.parametrize("name", COMMANDS)
def test_the_extra_is_named(
    name: str, main: Run, lack: Lack, tmp_path: Path, small_study: str
) -> None:
    words, module, extra = COMMANDS[name]
    (tmp_path / "study.toml").write_text(small_study)
    for texture in ("canvas", "MDF"):
        model = planted_texture(texture)
        model.save(tmp_path / "models" / f"{texture}.json")
        fewer = replace(model, gains=model.gains * 0.5)
        fewer.save(tmp_path / "other" / f"{texture}.json")
    rig_file(tmp_path, ('kind = "scripted"', 'kind = "serial"')).path.rename(
        tmp_path / "serial.toml"
    )
    rig_file(tmp_path, ("[real_surface]", f"{ACCELEROMETER}[real_surface]"))
    before = sorted(tmp_path.rglob("*"))
    lack(module)
    done = main(*words)
    assert done.returncode == 1
    assert done.stderr.startswith("error: expected ")
    assert module in done.stderr
    assert f"tactileq[{extra}]" in done.stderr
    assert done.stderr.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("module", ["sounddevice", "serial"])
def test_a_rig_is_checked_without_the_extra(
    module: str, main: Run, lack: Lack, tmp_path: Path
) -> None:
    rig_file(tmp_path)
    lack(module)
    done = main("rig", "check", "--rig", "rig.toml")
    assert done.stderr == ""
    assert "scripted" in done.stdout  # what does not need it was looked at
    if module == "sounddevice":
        assert "tactileq[rig]" in "".join(done.stdout.split())
