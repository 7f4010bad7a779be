"""Which bytes of a WAV file are samples: by its chunks, since sizes in headers are often wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from tactileq.modeling.errors import InputError

Order = Literal["little", "big"]
WAV_FORMS = {b"RIFF": b"RIFF", b"RIFX": b"RIFX", b"RF64": b"RIFF", b"BW64": b"RIFF"}
# Chunks that stand beside samples; with any other name they must fit without a gap.
_BESIDE = re.compile(
    rb"LIST|JUNK|junk|FLLR|PAD |fact|PEAK|bext|iXML|axml|chna|cart|id3 |ID3 |cue |smpl|inst|acid"
    rb"|DISP|_PMX"
)
_NEXT = re.compile(_BESIDE.pattern + b"|fmt |data")
_TEXTS = re.compile(rb"LIST....(INFO|adtl)", re.DOTALL)
_NAME = re.compile(rb"[ -~]{4}")
_STRAY = re.compile(rb"[ -~]{4,7}")  # text too short for a chunk
_LONGEST_HEADER = 128  # that a program may have counted as samples by mistake
_LARGEST = 0xFFFF0000  # bytes of samples, for which the sizes of RIFF suffice


@dataclass(frozen=True)
class HeldSamples:
    """The format and the samples that a WAV file holds, and what its header says otherwise."""

    form: bytes
    fmt: bytes
    fact: bytes
    samples: bytes
    doubt: str = ""

    def file(self, *, longest_fmt: int | None = None) -> bytes:
        """A WAV file of these, and nothing else, whose sizes are right."""
        contents = {b"fmt ": self.fmt[:longest_fmt], b"fact": self.fact, b"data": self.samples}
        chunks = [self._chunk(name, content) for name, content in contents.items() if content]
        return self._chunk(self.form, b"".join([b"WAVE", *chunks]))

    def _chunk(self, name: bytes, content: bytes) -> bytes:
        order: Order = _order(self.form)
        return b"".join([name, len(content).to_bytes(4, order), content, bytes(len(content) % 2)])


def held_samples(data: bytes, path: Path) -> HeldSamples:
    """What a WAV file holds, with a sentence where that is not what its header says.

    A header that was never closed, or not since, says too little; one of a stream nothing; some
    programs count the header itself. All samples are taken then. Chunks behind them are none.

    Parameters
    ----------
    data : bytes
        The whole file.
    path : Path
        Its place, for messages.

    Raises
    ------
    InputError
        For what is no WAV file, holds no samples or fewer than its header announces, and where
        bytes behind the announced samples may be either samples or another chunk.
    """
    header = _Header(data, path)
    end = header.samples_end()
    doubt = header.judged(end)
    found = (end - header.start) // header.frame * header.frame
    if found > _LARGEST:
        raise InputError(
            f"expected at most 4 GiB of samples in {path}, got {found} bytes; cut it into parts."
        )
    samples = data[header.start : header.start + found]
    # The number of samples in a wrong header's `fact` is as wrong.
    return HeldSamples(
        WAV_FORMS[data[:4]], header.fmt, b"" if doubt else header.fact, samples, doubt=doubt
    )


class _Header:
    """What the chunks before the samples say.

    `end` is the announced end of the file, and `size` the announced bytes of samples; None where a
    stream's header says nothing.
    """

    def __init__(self, data: bytes, path: Path) -> None:
        self.data, self.path, self.order = data, path, _order(data[:4])
        found: dict[bytes, tuple[int, int]] = {}
        if data[:4] in WAV_FORMS and data[8:12] == b"WAVE":
            for name, start, size in _chunks(data, 12, self.order):
                found.setdefault(name, (start, size))
                if name == b"data":
                    break
        fmt, fact, long = (
            data[start : start + size]
            for start, size in (found.get(name, (0, 0)) for name in (b"fmt ", b"fact", b"ds64"))
        )
        if b"data" not in found or len(fmt) < 16:
            raise InputError(
                f"expected a WAV file with a format and samples, got {path}, which holds something "
                "else; convert it."
            )
        self.fmt, self.fact = fmt, fact[:4]
        self.start, size = found[b"data"]
        riff = self._number(data, 4)
        if long and riff == 0xFFFFFFFF:
            riff = self._number(long, 0, length=8)
        if long and size == 0xFFFFFFFF:
            size = self._number(long, 8, length=8)
        self.end = None if riff == 0 or _is_open(riff) else riff + 8
        self.size = None if _is_open(size) and self.start + size > len(data) else size

    def _number(self, data: bytes, at: int, *, length: int = 4) -> int:
        return int.from_bytes(data[at : at + length], self.order)

    @cached_property
    def is_encoded(self) -> bool:
        """Whether blocks stand for several samples each."""
        channels, align = (self._number(self.fmt, at, length=2) for at in (2, 12))
        return not 0 < align <= 8 * channels

    @cached_property
    def frame(self) -> int:
        """Bytes of a sample of all channels; 1 where they are encoded in blocks."""
        return 1 if self.is_encoded else self._number(self.fmt, 12, length=2)

    def samples_end(self) -> int:
        """Where the samples end: as announced, else before chunks that end with the file, or there.

        Raises
        ------
        InputError
            Where bytes behind the announced samples may be either.
        """
        if self.size is not None:
            at = self.start + self.size
            if at <= len(self.data) and self._end_at(_behind(self.data, at, self.size)):
                return at
        end = self._end_of_file
        if cut := _TEXTS.search(self.data, self.start, end):
            raise self._either(cut.start())
        # Of samples of one byte, only the value tells the last one from a pad byte.
        may_be_pad = self.frame == 1 and not self.is_encoded and (end - self.start) % 2 == 0
        return end - (may_be_pad and self.data[self.start : end].endswith(b"\0"))

    @cached_property
    def _end_of_file(self) -> int:
        """The end, or where the chunks begin with which the file ends."""
        places = (found.start() for found in _BESIDE.finditer(self.data, self.start))
        return next(
            (at for at in places if _names_to_end(self.data, at, self.order)), len(self.data)
        )

    def _end_at(self, at: int) -> bool:
        """Whether what stands from here on are no samples."""
        if at >= len(self.data):
            return True
        is_known = _BESIDE.match(self.data, at) is not None
        if self._end_of_file < at:  # within a chunk
            return False
        if _STRAY.fullmatch(self.data, at):
            return True
        names = _names_to_end(self.data, at, self.order)
        is_covered = self.end is not None and self.end + 1 >= len(self.data)
        if not (names or is_known):
            return False
        if b"data" not in names and (is_covered or (names and (is_known or self.end is None))):
            return True
        raise self._either(at)

    def _either(self, at: int) -> InputError:
        name = self.data[at : at + 4].decode("ascii")
        return InputError(
            f"expected samples in {self.path} whose end its header tells, got bytes from {at} on "
            f"that may be more of them or a chunk {name!r}; save it again with the program that "
            "recorded it."
        )

    def judged(self, end: int) -> str:
        """What to be told of samples that end here; nothing where the header is right.

        Raises
        ------
        InputError
            For a file that is truncated or empty.
        """
        held = end - self.start
        size = held if self.size is None else self.size
        if self._says_more(size, end):
            announced = max(self.end or 0, self.start + size)
            raise InputError(
                f"expected {self._samples(size)} and {announced} bytes in {self.path}, as its "
                f"header says, got {self._samples(held)} and {len(self.data)} bytes; the file is "
                "truncated, copy or record it again."
            )
        announces = "no number of samples" if self.size is None else self._samples(size)
        if held < self.frame:
            raise InputError(
                f"expected samples in {self.path}, got none, and a header that announces "
                f"{announces}; record it again."
            )
        if self.size is not None and size // self.frame == held // self.frame:
            return ""
        return (
            f"{self.path.name}: its header announces {announces}, but the file holds "
            f"{self._samples(held)}, and all of them were taken; if there should be more, copy or "
            "record it again."
        )

    def _says_more(self, size: int, end: int) -> bool:
        """Whether the header says more than there is, other than by the bytes of headers.

        One of its two sizes alone may be wrong: that of the file is believed where it is right, and
        that of the samples where another chunk follows them.
        """
        held, length = end - self.start, len(self.data)
        headers = {36, 44, *(n for n in (self.start - 8, self.start) if n <= _LONGEST_HEADER)}
        lacking = 0 if self.end is None else self.end - length  # a last pad byte may lack
        if lacking > 1 and lacking not in headers and not (size == held and end + 1 < length):
            return True
        is_short = size // self.frame > held // self.frame and size - held not in headers
        return is_short and (self.end is None or lacking not in (0, -1))

    def _samples(self, size: int) -> str:
        return f"{size // self.frame} {'bytes of samples' if self.is_encoded else 'samples'}"


def _order(form: bytes) -> Order:
    return "big" if form == b"RIFX" else "little"


def _is_open(size: int) -> bool:
    """Whether a size says nothing: about the largest there is, as streams have."""
    return size >> 16 in (0x7FFF, 0x8000, 0xFFFF) or size >= 1 << 62


def _chunks(data: bytes, at: int, order: Order) -> Iterator[tuple[bytes, int, int]]:
    """Name, begin and announced size of each chunk from here on, until one has no name."""
    while at + 8 <= len(data) and (name := _NAME.match(data, at)):
        size = int.from_bytes(data[at + 4 : at + 8], order)
        yield name[0], at + 8, size
        at = _behind(data, at + 8 + size, size)


def _behind(data: bytes, end: int, size: int) -> int:
    """Where the next chunk begins: behind a pad byte, which some programs leave out."""
    if size % 2 == 0 or _NEXT.match(data, end):
        return end
    return end + (data[end : end + 1] == b"\0" or _NEXT.match(data, end + 1) is not None)


def _names_to_end(data: bytes, at: int, order: Order) -> list[bytes]:
    """Names of the chunks that fill a file from here to its end; none where they do not."""
    names, rest = [], len(data)
    for name, start, size in _chunks(data, at, order):
        names.append(name)
        rest = _behind(data, start + size, size)
        if start + size > len(data):
            return []
    is_filled = rest >= len(data) or _STRAY.fullmatch(data, rest) is not None
    return names if is_filled else []
