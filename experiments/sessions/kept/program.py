"""The program that ran a session, as its manifest describes it."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = (
    *("tactileq", "psychopy", "numpy", "scipy", "pandas", "questplus"),
    *("sounddevice", "soundfile", "pyserial", "cffi"),
)
_HERE = Path(__file__).resolve()


@cache
def program_facts() -> dict[str, Any]:
    """Versions, platform, revision and lock of the program, as a manifest holds them.

    Returns
    -------
    dict
        versions: of Python and of the packages that are installed; platform; git_revision: the
        commit, empty where the program does not lie in its repository; git_uncommitted: whether
        files differ from that commit, None where there is none; lock_sha256: of requirements.lock,
        empty where there is none.
    """
    revision, uncommitted = _git_state()
    return {
        "versions": {"python": platform.python_version(), **_versions()},
        "platform": platform.platform(),
        "git_revision": revision,
        "git_uncommitted": uncommitted,
        "lock_sha256": _lock_sha256(),
    }


def _versions() -> dict[str, str]:
    found = {}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _lock_sha256() -> str:
    try:
        return hashlib.sha256((_HERE.parents[3] / "requirements.lock").read_bytes()).hexdigest()
    except OSError:
        return ""


def _git_state() -> tuple[str, bool | None]:
    """The commit, and whether files differ from it; nothing where git does not know this file."""
    try:
        # An environment may lie within somebody else's repository, which does not know this file.
        _git("ls-files", "--error-unmatch", _HERE.name)
        return _git("rev-parse", "HEAD"), bool(
            _git("status", "--porcelain", "--untracked-files=no")
        )
    except (OSError, subprocess.SubprocessError):
        return "", None


def _git(*arguments: str) -> str:
    """What git says in the folder of this file, whatever repository the environment names."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    ended = subprocess.run(
        ["git", "--no-optional-locks", "-c", "safe.directory=*", *arguments],
        cwd=_HERE.parent,
        env=environment,
        timeout=20,
        check=True,
        capture_output=True,
        text=True,
    )
    return ended.stdout.strip()
