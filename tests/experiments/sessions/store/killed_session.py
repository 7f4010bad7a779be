"""Runs small sessions in processes of their own, for the tests of what survives them.

    killed_session.py kill FOLDER FROM   SIGKILL after every call that changes a disk, in turn, and
                                         in the middle of every write; from nothing, or on a copy
                                         of the data in FROM, resumed
    killed_session.py race FOLDER        eight consoles at once

What a session did is told in FOLDER/NAME.told: each answer that it was told is safe, and to which
length each log was forced to disk.
"""

import json
import os
import shutil
import signal
import sys
import time
from functools import partial
from pathlib import Path

import filelock  # noqa: F401  # once, and not in each of a hundred children
import numpy as np

from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.resume import resumption
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.modeling import InputError
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.rig.shared.interface import HandRows, PresentationRecord
from tests.experiments.scripted import rated
from tests.interrupting import Interrupter, forked

ROWS = HandRows(
    time_s=np.array([0.1, 0.2]),
    speed_mm_s=np.array([10.0, 12.0]),
    force_n=np.array([0.5, 0.6]),
    surface=np.array([1, 2]),
    presentation=np.array([1, 2]),
    force_assumed=np.array([False, False]),
)
SHOWN = PresentationRecord(number=1, surface="real", texture="canvas", start_s=0.0, end_s=0.3)


def manifest(subject=1):
    phases = ["training", "main", "main", "main"]
    return SessionManifest(
        task="absolute",
        subject=subject,
        session=1,
        slot=subject,
        code="TAKI-46",
        language="en",
        pilot=False,
        simulated_participant=False,
        simulated_rig=False,
        study={"name": "Small"},
        study_sha256=sha256_of_values({"name": "Small"}),
        plan_sha256="bb",
        models_sha256={"canvas": {"full": "cc", "simplified": "dd"}},
        model_sources={},
        identical={},
        rig={},
        description="Compare",
        trials=[{"trial": n, "phase": phase} for n, phase in enumerate(phases, start=1)],
        versions={},
        platform="",
        git_revision="",
        git_uncommitted=None,
        lock_sha256="",
    )


def run(folder, tell, resumed=False):
    """One session, from its enrolment or its resumption to the end."""
    begin = SessionStore.resume if resumed else SessionStore.create
    with Roster(folder).enrolling(1, 4):
        store = begin(folder, manifest())
    with store:
        left = resumption(store.manifest, store.before, longest_gap_min=30)
        for trial in left.next_trials:
            number = trial["trial"]
            store.log("mount_requested", trial=number, tray="C")
            store.log("presented", trial=number, surface="real")
            store.log("slider", trial=number, scale="magnitude", value=10.0 * number)
            store.answer(number, rated(number, magnitude_similarity=10.0 * number))
            tell(f"answer {number}")
            store.trace(number, ROWS, presentations=[SHOWN], faults=())
        store.finish("complete")


def teller(path):
    write = os.write
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    return lambda line: write(handle, f"{line}\n".encode())


def tell_size(tell, handle):
    """To which length a log was forced to disk."""
    path = os.readlink(f"/proc/self/fd/{handle}")
    if path.endswith(".jsonl"):
        tell(f"safe {os.fstat(handle).st_size} {Path(path).name}")


def kill_everywhere(root, begun):
    ended = {}
    for torn in (False, True):
        code, at = -signal.SIGKILL, 0
        while code == -signal.SIGKILL:
            at += 1
            name = f"{'torn' if torn else 'after'}-{at}"
            if begun:
                shutil.copytree(begun, root / name)

            def work(at=at, torn=torn, name=name):
                tell = teller(root / f"{name}.told")
                Interrupter(root, at=at, torn=torn, forced=partial(tell_size, tell))
                run(root / name, tell, resumed=begun is not None)

            code = ended[name] = forked(work)
    print(json.dumps(ended))


def race(root):
    """Eight consoles want two subjects, all at the same moment; each tells how it went."""
    go = time.monotonic() + 0.3
    children = []
    for number in range(8):
        child = os.fork()
        if not child:
            tell = teller(root / f"{number}.told")
            try:
                time.sleep(max(go - time.monotonic(), 0))
                subject = number % 2 + 1
                with Roster(root / "data").enrolling(subject, 4):
                    store = SessionStore.create(root / "data", manifest(subject))
                with store:
                    store.answer(1, rated(1))
                    time.sleep(0.3)
                    store.finish("complete")
                tell("ran")
            except InputError as error:
                tell(str(error))
            os._exit(0)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)


if __name__ == "__main__":
    what, folder = sys.argv[1], Path(sys.argv[2])
    if what == "race":
        race(folder)
    else:
        kill_everywhere(folder, Path(sys.argv[3]) if sys.argv[3:] else None)
