"""Two processes at one rig: the second is refused."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.rig.desk.lock import rig_locked
from tests.refusals import check_refusal, refused

ROOT = Path(__file__).parents[3]
HOLDING = """
import sys
from tactileq.rig.desk.lock import rig_locked
with rig_locked(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_second_is_told_who_holds_the_rig_until_that_one_is_gone(tmp_path: Path) -> None:
    name = str(tmp_path)
    words = [sys.executable, "-c", HOLDING, name]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(words, cwd=ROOT, **pipes) as holder:  # type: ignore[call-overload]
        assert holder.stdout.readline() == b"held\n"
        with refused(InputError, names=[shown(name), holder.pid]), rig_locked(name):
            raise AssertionError
        with rig_locked(name + " (another)"):
            pass
        holder.kill()
    with rig_locked(name):
        pass
    with rig_locked(name):
        pass


def test_a_link_in_its_place_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with rig_locked("rig"):
        (folder,) = tmp_path.iterdir()
        (path,) = folder.iterdir()
    assert not path.exists()
    precious = tmp_path / "precious"
    for contents in ("x", None):
        if contents:
            precious.write_text(contents)
        path.symlink_to(precious)
        with refused(InputError, expected=path, got="link"), rig_locked("rig"):
            raise AssertionError
        assert (precious.read_text() if contents else precious.exists()) == (contents or False)
        path.unlink()
        precious.unlink(missing_ok=True)
    folder.rename(precious)
    folder.symlink_to(precious)
    with refused(InputError, expected=folder, got="link"), rig_locked("rig"):
        raise AssertionError
    assert not list(precious.iterdir())


def mode_of(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


@pytest.mark.parametrize("mode", [None, 0o777, 0o700, 0o755])
def test_nobody_may_remove_what_another_user_left_in_their_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int | None
) -> None:
    """Whatever the mask, and the mode that the user's own folder has had before."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = tmp_path / "tactileq-rigs"
    if mode is not None:
        folder.mkdir()
        folder.chmod(mode)
    mask = os.umask(0o077)
    try:
        with rig_locked("rig"):
            assert mode_of(folder) == 0o1777
    finally:
        os.umask(mask)


@pytest.mark.skipif(os.getuid() != 0, reason="expected root, to run as two users")
@pytest.mark.parametrize("mode", [0o777, 0o755, 0o700])
def test_a_folder_that_another_user_does_not_share_is_refused(
    monkeypatch: pytest.MonkeyPatch, mode: int
) -> None:
    """Not used without a lock: then two might use one rig."""
    with shared_folder(monkeypatch) as place:
        folder = place / "tactileq-rigs"
        folder.mkdir()
        os.chown(folder, 12345, 12345)
        folder.chmod(mode)
        check_refusal(told(12346, "left"), names=folder, expected="1777", got=f"{mode:o}")
        assert mode_of(folder) == mode
        assert told(12345, "left") == "held"
        assert mode_of(folder) == 0o1777
        assert told(12346, "left") == "held"


@contextmanager
def shared_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """One for temporary files; not in a folder of pytest's, which other users may not enter."""
    with tempfile.TemporaryDirectory() as name:
        monkeypatch.setattr("tempfile.tempdir", name)
        Path(name).chmod(0o1777)
        yield Path(name)


def told(uid: int, end: str) -> str:
    """What another user is told, who then leaves or is killed."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.setuid(uid)
        try:
            with rig_locked("rig"):
                os.write(writing, b"held")
                os.kill(os.getpid(), signal.SIGKILL) if end == "killed" else None
        except InputError as error:
            os.write(writing, str(error).encode())
        os._exit(0)
    os.waitpid(child, 0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        return pipe.read()


@pytest.mark.skipif(os.getuid() != 0, reason="expected root, to run as two users")
def test_two_users_of_a_machine_exclude_each_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with shared_folder(monkeypatch) as place:
        with rig_locked("rig"):
            assert f"in use by process {os.getpid()}" in told(12345, "left")
        for uid, end in ((12345, "left"), (12345, "killed"), (12346, "killed"), (12345, "left")):
            assert told(uid, end) == "held"
        with rig_locked("rig"):
            pass
        left = {path.stat().st_uid for path in (place / "tactileq-rigs").iterdir()}
        assert left == {12346}  # what it left others may neither remove nor lock
