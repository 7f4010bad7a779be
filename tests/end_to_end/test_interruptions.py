"""Signals while something is computed, by several processes: nothing lost, nobody writing on.

Each command meets three moments of SIGTERM and three of SIGKILL, `TACTILEQ_MOMENTS=10` of them in
half an hour. Where files are written, `test_file_events.py` ends commands after each call.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import simplify as drop_layers
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.perception.verdicts import ENDING
from tactileq.stimuli.planted.textures import planted_texture, record_texture

MOMENTS = int(os.environ.get("TACTILEQ_MOMENTS", "3"))

Files = dict[str, bytes]

FOLDERS = ("--recordings", "recordings", "--models", "models", "--simplified", "simplified")
# Each writes to `out`; `{}` stands for what differs between an earlier run and the interrupted one:
# their number, or `{one|other}`.
LONG = {
    "model": ("model", "recordings", "--jobs", "2", "--layers", "{}"),
    "scene": ("scene", "{light.toml|strong.toml}"),
    "simulate": ("simulate", "--study", "study.toml", "--data", "out", "--seed", "{}"),
    "power": ("power", "claims.toml", "--subjects", "[8,16]", "--jobs", "2", "--seed", "{}"),
    "analyze": ("analyze", "data", *FOLDERS, "--seed", "{}"),
    "demo": ("demo", "--seed", "{}"),
    "chart": ("bench", "chart", "--toolkit", "{}.xml", "--method", "AR(6)", "--jobs", "2"),
    "stability": ("stability", "--reduced", "--only", "{blending|vibrators}", "--jobs", "2"),
}
NEW_PLACES = ("simulate",)  # these refuse what is there


def words_of(name: str, which: int) -> list[str]:
    """The command line of an earlier run (1) or a later one (2)."""
    out = () if name in NEW_PLACES else ("--out", "out")
    words = [
        word[1:-1].split("|")[which - 1] if "|" in word else word.replace("{}", str(which))
        for word in (*LONG[name], *out)
    ]
    return [sys.executable, "-m", "tactileq", *words]


@pytest.fixture
def place(
    tmp_path: Path, hatt_xml: Callable[..., str], small_study: str, claimed_study: str
) -> Path:
    """Small inputs of every command."""
    axes = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
    for name in ("canvas", "PVC"):  # a layer of PVC is dropped
        truth = planted_texture(name, **axes)
        records = record_texture(truth, duration_s=0.5)
        records.save(tmp_path / "recordings" / name)
        truth.save(tmp_path / f"models/{name}.json")
        fewer = drop_layers(truth, Threshold.named("codec"))
        fewer.model.save(tmp_path / f"simplified/{name}.json")
        fewer.save(tmp_path / f"simplified/{name}{ENDING}")
    for name in ("1", "2"):
        (tmp_path / f"{name}.xml").write_text(hatt_xml(material=name), encoding="utf-8")
    (tmp_path / "study.toml").write_text(small_study.replace("MDF", "PVC"))
    (tmp_path / "claims.toml").write_text(claimed_study.replace("MDF", "PVC"))
    for name, force_n in (("light", 1), ("strong", 3)):
        hand = f"speed_mm_s = [100, 300], force_n = [1, {force_n}]"
        scene = f'version = 1\nscene.name = "{name}"\nhand = {{{hand}}}\n'
        (tmp_path / f"{name}.toml").write_text(scene)
    return tmp_path


def start(words: list[str], place: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        words,
        cwd=place,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def told_by(process: subprocess.Popen[str]) -> str:
    """What a process says on stderr until it ends; it does not outlive the test."""
    try:
        return process.communicate()[1]
    except BaseException:
        process.kill()
        raise


def finish(words: list[str], place: Path) -> float:
    """Run to the end; how long it took."""
    began = time.monotonic()
    process = start(words, place)
    told = told_by(process)
    assert process.returncode == 0, told
    return time.monotonic() - began


def interrupt(words: list[str], place: Path, *, number: int, after_s: float) -> tuple[int, str]:
    """Send a signal after a while; the exit code and what was told, once nobody of it lives."""
    process = start(words, place)
    time.sleep(after_s)
    process.send_signal(number)
    told = told_by(process)
    for _ in range(100):
        if not living(process.pid):
            break
        time.sleep(0.1)
    assert not living(process.pid)
    return process.returncode, told


def living(group: int) -> list[str]:
    """Processes of a group that have not ended."""
    listed = subprocess.run(
        ["ps", "-A", "-o", "pgid=,stat=,args="], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    rows = [line.split(None, 2) for line in listed]
    return [str(row) for row in rows if row[0] == str(group) and not row[1].startswith("Z")]


def contents(folder: Path) -> dict[str, bytes]:
    """All finished files below a folder, but for logs, whose times differ from run to run."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.parts)
        if not path.name.endswith("_log.tsv")
    }


def hidden(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(".*")]


def groups(files: dict[str, bytes], name: str) -> dict[str, dict[str, bytes]]:
    """The files that are written together: all of a folder, or those of one texture."""
    if name != "model":
        return {"": files}
    return {
        texture: {file: data for file, data in files.items() if file.startswith(texture)}
        for texture in ("canvas", "PVC")
    }


def assert_kept(name: str, found: dict[str, bytes], *, old: Files, new: Files) -> None:
    """Each group of files is the old one or the new one, whole."""
    if name == "simulate":  # answers are appended, each on the disk before the next is asked
        for file in (file for file in found if file.endswith("_beh.tsv")):
            assert new[file].startswith(found[file])
        return
    if name == "demo":  # all but the answers holds times, which differ from run to run
        found, old, new = (
            {file: data * file.endswith("_beh.tsv") for file, data in files.items()}
            for files in (found, old, new)
        )
    olds, news = groups(old, name), groups(new, name)
    for group, files in groups(found, name).items():
        assert files in (olds[group], news[group]), group


def moments(count: int) -> list[tuple[int, float]]:
    """Signals and the shares of the command's time after which they come."""
    shares = [0.2 + 0.8 * (n + 0.5) / count for n in range(count)]
    return [(number, share) for number in (signal.SIGTERM, signal.SIGKILL) for share in shares]


@pytest.mark.long("interruptions at many moments")
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", LONG)
def test_interrupted_at_many_moments(place: Path, name: str) -> None:
    out, kept = place / "out", place / "kept"
    kept.mkdir()
    if name == "analyze":
        finish(words_of("simulate", 1), place)
        out.rename(place / "data")
    if name not in NEW_PLACES:
        finish(words_of(name, 1), place)
        shutil.copytree(out, kept, dirs_exist_ok=True)

    def restore() -> None:
        shutil.rmtree(out, ignore_errors=True)
        if any(kept.iterdir()):
            shutil.copytree(kept, out)

    takes_s = finish(words_of(name, 2), place)
    old, new = contents(kept), contents(out)
    assert new != old
    restore()
    for number, share in moments(MOMENTS):
        words = words_of(name, 2)
        code, told = interrupt(words, place, number=number, after_s=share * takes_s)
        assert code in (0, -number, 128 + number), told
        if number == signal.SIGTERM:
            sentence = "interrupted by SIGTERM; no file was left half written."
            # Else it came before the program could take it, or after all was done.
            assert code <= 0 or sentence in told.splitlines(), told
            assert not hidden(place)
        print(name, signal.Signals(number).name, f"{share:.2f}", code, hidden(place))
        whole = contents(out)
        assert_kept(name, whole, old=old, new=new)
        if whole != old:
            restore()
    finish(words_of(name, 2), place)
    assert contents(out).keys() == new.keys()
    assert not hidden(place)
