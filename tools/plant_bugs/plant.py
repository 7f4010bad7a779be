"""Plants bugs, one at a time, and sees whether the tests of their room notice them (make plant).

Each patch beside this file is one bug, named ROOM-what.patch; above its first line of `---` stands
what is wrong and who would suffer, and, where no test of its room can notice it, a line
`Survives: WHY`.

A bug is planted into a copy of the project, whose C parts are built anew where the patch changes
one. The tests of the copy run until one fails: those of the module, then of its sub-package, then
of its room. The bug is caught if that test fails a second time and passes without the patch. Else
it has failed for another reason, and the others go on without it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
LEAST_CAUGHT = 38
REASON = "Survives: "
SECONDS_PER_TEST = 60
NOT_COPIED = (".git", ".venv", ".*_cache", ".hypothesis", "build", "demo", "*.egg-info")


class Bug:
    """A patch of one file of a room."""

    def __init__(self, patch: Path) -> None:
        self.patch, self.name = patch, patch.stem
        lines = patch.read_text(encoding="utf-8").splitlines()
        self.file = next(Path(line[6:]) for line in lines if line.startswith("+++ b/"))
        self.room = self.file.parts[0]
        reasons = (line.removeprefix(REASON) for line in lines if line.startswith(REASON))
        self.why_it_survives = next(reasons, "")

    @property
    def is_in_c(self) -> bool:
        return self.file.suffix in (".h", ".c")

    def tests(self, copy: Path) -> list[Path]:
        """Where its room's tests are in a copy, those that are nearest to the bug first."""
        mirrored = copy / "tests" / self.file.parent
        nearest = [mirrored / f"test_{self.file.stem}.py", mirrored]
        nearest += [folder for folder in mirrored.parents if folder.is_relative_to(copy / "tests")]
        return [place for place in nearest if place.exists() and place != copy / "tests"]


class Copy:
    """The project in another folder, with C parts of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(*NOT_COPIED), symlinks=True)
        # Before the installed project, in every process that a test starts.
        own = {"PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"}
        # Else git applies a patch to the repository around the copy, if there is one.
        own["GIT_CEILING_DIRECTORIES"] = str(folder.parent)
        self._environment = {**os.environ, **own}
        self._require_own_modules()

    def plant(self, bug: Bug, *, take_out: bool = False) -> None:
        """Apply a patch, or take it out again."""
        words = ["git", "apply", *["--reverse"] * take_out, str(bug.patch)]
        self._run(*words)
        if bug.is_in_c:
            os.utime(self.folder / bug.file)
            self._run(sys.executable, "setup.py", "-q", "build_ext", "--inplace")

    def first_failure(self, place: str | Path, *, without: list[str | Path]) -> str:
        """The first test that fails there, or how pytest crashed; "" where none does."""
        failed = self.folder / ".pytest_cache" / "v" / "cache" / "lastfailed"
        failed.unlink(missing_ok=True)
        left_out = [f"--{'ignore' if isinstance(w, Path) else 'deselect'}={w}" for w in without]
        pytest = [sys.executable, "-m", "pytest", "-q", "-x", f"--timeout={SECONDS_PER_TEST}"]
        ended = self._ran(*pytest, *left_out, str(place))
        if ended.returncode < 0:  # a planted bug in C can take Python with it
            return str(place)
        if ended.returncode not in (0, 1, 5):  # 5: every test there is left out
            sys.exit(f"{' '.join(pytest)} {place}: {ended.stdout}{ended.stderr}")
        return next(iter(json.loads(failed.read_text()))) if ended.returncode == 1 else ""

    def _require_own_modules(self) -> None:
        """Refuse a copy whose tests would run the installed project."""
        modules = (
            "tactileq.modeling.rendering._kernel",
            "tactileq.rig.shared.live._live",
            "tactileq.app",
            "tests.conftest",
        )
        told = "; ".join(f"import {name} as m; print(m.__file__)" for name in modules)
        for file in self._run(sys.executable, "-c", told).split():
            if not Path(file).is_relative_to(self.folder):
                sys.exit(f"expected modules of {self.folder}, got {file}; run make install.")

    def _run(self, *words: str) -> str:
        """What it printed; it has to succeed."""
        ran = self._ran(*words)
        if ran.returncode:
            sys.exit(f"{' '.join(words)}: {ran.stdout}{ran.stderr}")
        return ran.stdout

    def _ran(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            words, cwd=self.folder, env=self._environment, capture_output=True, text=True
        )


def caught_by(bug: Bug, copy: Copy) -> str:
    """The test that notices a bug; "" where none of its room does."""
    without: list[str | Path] = []
    copy.plant(bug)
    for place in bug.tests(copy.folder):
        while test := copy.first_failure(place, without=without):
            if copy.first_failure(test, without=[]) and _passes_without(bug, copy, test):
                return test
            without.append(test)
        without.append(place)
    return ""


def _passes_without(bug: Bug, copy: Copy, test: str) -> bool:
    copy.plant(bug, take_out=True)
    passes = not copy.first_failure(test, without=[])
    copy.plant(bug)
    return passes


def all_bugs() -> list[Bug]:
    """Every patch beside this file, by name."""
    return [Bug(patch) for patch in sorted(HERE.glob("*.patch"))]


def main() -> None:
    """Plant the bugs that are asked for; exit code 1 where too many survive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bug", default="", help="only this one")
    parser.add_argument("--room", default="", help="only those of this room")
    asked = parser.parse_args()
    bugs = [
        bug for bug in all_bugs() if asked.bug in ("", bug.name) and asked.room in ("", bug.room)
    ]
    if not bugs:
        sys.exit(f"expected a bug of {HERE}, got --bug {asked.bug} --room {asked.room}.")
    began_s, caught, excused = time.monotonic(), 0, 0
    for bug in bugs:
        bug_began_s = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="tactileq-plant-") as folder:
            test = caught_by(bug, Copy(Path(folder).resolve() / "copy"))
        caught, excused = caught + bool(test), excused + bool(bug.why_it_survives and not test)
        verdict = f"caught   {bug.name} by {test}" if test else f"SURVIVED {bug.name}"
        why = f": {bug.why_it_survives}" * bool(bug.why_it_survives and not test)
        print(f"{verdict}{why} ({time.monotonic() - bug_began_s:.0f} s)", flush=True)
    print(f"{caught} of {len(bugs)} caught in {(time.monotonic() - began_s) / 60:.0f} min")
    if caught + excused < min(len(bugs), LEAST_CAUGHT):
        sys.exit(1)


if __name__ == "__main__":
    main()
