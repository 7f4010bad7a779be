"""The experimenter's terminal: which sample to mount, progress of the session, state of the rig.

It names trays, never a texture or a model (docs/method/protocols.md#mounting).
"""

from __future__ import annotations

import sys
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TextIO

from rich.console import Console
from rich.markup import escape

from tactileq.experiments.sessions.loop.people import ProgressReport, SessionAborted

STOP = "stop"
PAGES = {
    "consent": "reads the consent page",
    "code": "reads the code",
    "known": "is asked for the code",
    "wait": "waits for you",
    "rate": "compares and rates",
    "choose": "feels and chooses",
    "rest": "has a break",
    "stop": "is asked whether to stop",
}
CLOSED = "the experimenter's terminal was closed"


class Terminal:
    """An experimenter at a terminal: an `Experimenter` of sessions.

    Enter confirms what was asked last. A line "stop" ends the session at the next sample, or at
    once where one is asked for, and asks for the reason.

    Parameters
    ----------
    lines : text stream
        What the experimenter types.
    console : rich.console.Console, optional
        Where to write; the standard output without it.
    """

    def __init__(self, lines: TextIO = sys.stdin, *, console: Console | None = None) -> None:
        self._console = console or Console(highlight=False)
        self._typed: SimpleQueue[str | None] = SimpleQueue()
        self._stopping = False
        self._asked = False
        # A daemon thread, since nothing can interrupt waiting for a line.
        Thread(target=self._listen, args=(lines,), daemon=True).start()

    def ask_mount(self, tray: str) -> None:
        """Ask for the sample of a tray."""
        self._ask(f"[bold]Tray {escape(tray)}[/]: put its sample in place")

    def call(self, sentence: str) -> None:
        """Report what failed, and ask to repair it; the trial will be repeated."""
        self._ask(f"[bold]The rig failed in this trial.[/] {escape(sentence)} Repair it")

    def go_on(self) -> None:
        """Ask for nothing; a stop that was typed in the meantime counts."""
        self._asked = False
        self._forget_lines()

    def report(self, progress: ProgressReport) -> None:
        """Show the progress of the session and the state of the rig."""
        training = progress.phase == "training"
        parts = ["training" if training else f"{progress.done} of {progress.of} trials done"]
        if progress.minutes_left is not None:
            parts.append(f"about {max(1, round(progress.minutes_left))} min left")
        parts.append("rig: " + (" ".join(progress.problems) or "ready"))
        self._console.print("\n" + " · ".join(parts), markup=False)

    def page(self, name: str) -> None:
        """Show which page the participant is viewing."""
        self._console.print(f"  participant: {_on_page(name)}", markup=False)

    def answered(self) -> None:
        """Show that an answer was given."""
        self._console.print("  an answer was given")

    def ready(self) -> bool:
        """Whether what was asked last has been confirmed.

        Raises
        ------
        SessionAborted
            If the experimenter stops the session, or the terminal is closed.
        """
        if not (self._asked or self._stopping):
            return True
        line = self._next()
        if self._stopping:
            if line is None:
                return False
            raise SessionAborted(line or "not stated", by="experimenter")
        if line is not None and line.lower() == STOP:
            self._stopping = True
            self._console.print("Why? (one line, then Enter)")
            return False
        return line is not None

    def _ask(self, what: str) -> None:
        self._asked = True
        self._forget_lines()
        if not self._stopping:
            self._console.print(f"{what}, then press Enter (or type {STOP}).")

    def _forget_lines(self) -> None:
        """An earlier Enter must not confirm what is asked only now; an earlier stop counts."""
        while (line := self._next()) is not None:
            if line.lower() == STOP and not self._stopping:
                self._stopping = True
                self._console.print("Stopping. Why? (one line, then Enter)")

    def _next(self) -> str | None:
        try:
            line = self._typed.get_nowait()
        except Empty:
            return None
        if line is None:
            raise SessionAborted(CLOSED, by="experimenter")
        return line.strip()

    def _listen(self, lines: TextIO) -> None:
        for line in lines:
            self._typed.put(line)
        self._typed.put(None)


def _on_page(name: str) -> str:
    """What the participant does on a page."""
    kind, _, what = name.partition(" ")
    if kind == "question":
        return f"answers a question ({what})"
    return PAGES.get(name) or f"reads a page ({name.rpartition('.')[2].replace('_', ' ')})"
