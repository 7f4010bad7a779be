"""Tables of a session that only grow, by whole rows: the hand's history, what was presented."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from tactileq.experiments.sessions.kept.files import open_file, write_all
from tactileq.experiments.sessions.kept.writer import store_error
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.tables import guarded

MISSING = "n/a"


class GrowingTable:
    """A table whose rows the system writes to the disk in its own time.

    Parameters
    ----------
    path : Path
        Where a table is there, as another run of the session left it, rows follow its whole ones.

    Raises
    ------
    InputError
        If a table of other columns is there.
    OSError
        If the disk does not take the header.
    """

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self.path = path
        self._columns = names(columns)
        self._handle = open_file(path, new=False)
        try:
            self._begin()
        except BaseException:
            os.close(self._handle)
            raise

    def _begin(self) -> None:
        there = self.path.read_bytes()
        whole = there[: there.rfind(b"\n") + 1]
        header = "\t".join(self._columns).encode() + b"\n"
        if whole and not whole.startswith(header):
            raise InputError(
                f"expected the columns {', '.join(self._columns)} in {self.path}, got "
                f"{shown(whole.splitlines()[0].decode('utf-8', 'replace'))}; move that file away."
            )
        if len(whole) < len(there):
            os.ftruncate(self._handle, len(whole))
        if not whole:
            write_all(self._handle, header)

    def extend(self, rows: Iterable[Mapping[str, object]]) -> None:
        """Append rows.

        Raises
        ------
        StoreError
            If the disk does not take them; the rows before them stay as they are.
        """
        self.extend_lines(map(self._line, rows))

    def extend_lines(self, lines: Iterable[str]) -> None:
        """Append rows that are lines of cells already, each with its end; raises as `extend`."""
        end = os.fstat(self._handle).st_size
        try:
            write_all(self._handle, "".join(lines).encode())
        except OSError as error:
            # Half a row would spoil the table for every reader: cut it off again.
            with suppress(OSError):
                os.ftruncate(self._handle, end)
            raise store_error(error, self.path) from error

    def _line(self, row: Mapping[str, object]) -> str:
        return "\t".join([cell(row[column]) for column in self._columns]) + "\n"

    def close(self) -> None:
        """Close the file."""
        os.close(self._handle)


def cell(value: object) -> str:
    r"""A value as one cell of a table: n/a for nothing, and no tab, line end or quote in it.

    Characters that would break a row are written as Python would (``\t``, ``\n``, ``\x22``).

    Raises
    ------
    InputError
        For an infinite number.
    """
    if type(value) is int:  # as most are
        return str(value)
    if value is None or value == "":
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float | np.floating):
        if math.isinf(value):
            raise InputError(f"expected a finite number in a row, got {value}; present it again.")
        return MISSING if math.isnan(value) else f"{value:.10g}"
    text = guarded(str(value))
    if text.isprintable() and "\\" not in text and '"' not in text:
        return text  # as nearly all are
    return "".join(_plain(character) for character in text)


def _plain(character: str) -> str:
    if character == "\\":
        return "\\\\"
    if character == '"':
        # A reader that knows quotes would swallow tabs and lines after a leading one.
        return "\\x22"
    if character.isprintable():
        return character
    return character.encode("unicode_escape").decode("ascii")
