"""WAV files whose headers are wrong: all samples that are there, said in words, or refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.files.wav import read_wav_channels

OPEN = (0xFFFFFFFF, 0x7FFFF000, 0x80000000)
COUNTED = (36, 44)
Sizes = Callable[[int], int]


def right(size: int) -> int:
    return size


@dataclass(frozen=True)
class Written:
    """A WAV file of random bytes as samples, and what its header says of them."""

    form: str = "RIFF"
    bits: int = 16
    channels: int = 1
    is_float: bool = False
    is_extensible: bool = False
    frames: int = 500
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    is_padded: bool = True
    data_size: Sizes = right
    riff_size: Sizes = right
    samples: bytes = b""

    @property
    def order(self) -> Literal["little", "big"]:
        return "big" if self.form == "RIFX" else "little"

    @property
    def frame(self) -> int:
        return self.channels * self.bits // 8

    @property
    def data(self) -> bytes:
        if self.samples or self.is_float:
            return self.samples or self._floats()
        generator = np.random.default_rng(self.frames)
        return generator.integers(1, 256, self.frames * self.frame, np.uint8).tobytes()

    def _floats(self) -> bytes:
        values = np.random.default_rng(self.frames).uniform(-1, 1, self.frames * self.channels)
        sign = ">" if self.order == "big" else "<"
        return values.astype(f"{sign}f{self.bits // 8}").tobytes()

    def chunk(self, name: str, content: bytes, size: int | None = None) -> bytes:
        stated = self._number(len(content) if size is None else size)
        pad = bytes(len(content) % 2 * self.is_padded)
        return name.ljust(4).encode() + stated + content + pad

    def _number(self, value: int, length: int = 4) -> bytes:
        return value.to_bytes(length, self.order)

    def _fmt(self) -> bytes:
        kind = 3 if self.is_float else 1
        rate = 8000
        values = ((self.channels, 2), (rate, 4), (rate * self.frame, 4), (self.frame, 2))
        basic = b"".join(self._number(*one) for one in (*values, (self.bits, 2)))
        if not self.is_extensible:
            return self._number(kind, 2) + basic
        guid = self._number(kind) + self._number(0, 2) + self._number(16, 2)
        rest = b"\x80\0\0\xaa\0\x38\x9b\x71"
        return (
            self._number(0xFFFE, 2)
            + basic
            + self._number(22, 2)
            + self._number(self.bits, 2)
            + self._number(0)
            + guid
            + rest
        )

    def bytes(self) -> tuple[bytes, int]:
        """The file, and where its samples begin."""
        is_64 = self.form in ("RF64", "BW64")
        size = self.data_size(len(self.data))
        before = [self.chunk(name, b"INFOa" * 3) for name in self.before]
        after = b"".join(self.chunk(name, b"INFOb" * 3) for name in self.after)
        stated = 0xFFFFFFFF if is_64 else size
        last = self.chunk("data", self.data, stated)
        head = b"".join([*before, self.chunk("fmt", self._fmt())])
        length = 4 + len(head) + len(last) + len(after) + 36 * is_64
        riff = self.riff_size(length)
        ds64 = b""
        if is_64:
            ds64 = self._number(riff, 8) + self._number(size, 8) + bytes(12)
            ds64 = self.chunk("ds64", ds64)
        beginning = self.form.encode() + self._number(0xFFFFFFFF if is_64 else riff) + b"WAVE"
        whole = beginning + ds64 + head + last + after
        return whole, len(beginning + ds64 + head) + 8

    def truth(self, path: Path) -> np.ndarray:
        """Its samples by a file with nothing wrong."""
        plain = replace(self, before=(), after=(), data_size=right, riff_size=right)
        form = "RIFX" if self.form == "RIFX" else "RIFF"
        path.write_bytes(replace(plain, form=form, is_padded=True).bytes()[0])
        import soundfile

        return soundfile.read(path, dtype="float64", always_2d=True)[0]


def read(path: Path) -> tuple[np.ndarray, list[str]]:
    told: list[str] = []
    return read_wav_channels(path, tell=told.append)[0], told


def lower(size: int) -> int:
    return size // 3


def none(size: int) -> int:
    return 0


SIZES: tuple[Sizes, ...] = (
    right,
    lower,
    none,
    *(lambda size, value=value: value for value in OPEN),
    *(lambda size, more=more: size + more for more in (*COUNTED, 1, 7)),
    lambda size: 3 * size,
)
KINDS = [(8, False), (16, False), (24, False), (32, False), (32, True), (64, True)]
NAMES = st.lists(st.sampled_from(["LIST", "JUNK", "bext", "fact", "FLLR", "id3"]), max_size=2)


@st.composite
def files(draw: st.DrawFn) -> Written:
    bits, is_float = draw(st.sampled_from(KINDS))
    return Written(
        form=draw(st.sampled_from(["RIFF", "RIFX", "RF64", "BW64"])),
        bits=bits,
        is_float=is_float,
        channels=draw(st.integers(1, 3)),
        is_extensible=draw(st.booleans()),
        frames=draw(st.integers(1, 200)),
        before=tuple(draw(NAMES)),
        after=tuple(draw(NAMES)),
        is_padded=draw(st.booleans()),
        data_size=draw(st.sampled_from(SIZES)),
        riff_size=draw(st.sampled_from(SIZES)),
    )


@given(file=files(), share=st.none() | st.floats(0, 1))
def test_all_samples_of_the_file_or_a_refusal(
    tmp_path_factory: pytest.TempPathFactory, file: Written, share: float | None
) -> None:
    """Never fewer than there are; fewer than were recorded only of a cut file that says no more."""
    # A pad byte that is counted cannot be told from a sample of one byte.
    assume(file.frame > 1 or file.data_size(8) != 9)
    path = tmp_path_factory.getbasetemp() / "one.wav"
    truth = file.truth(path)
    whole, start = file.bytes()
    assume(not file.after or file.data_size(len(file.data)) != len(whole) - start)
    cut = whole if share is None else whole[: int(share * len(whole))]
    path.write_bytes(cut)
    data_end = start + len(file.data)
    there = max(min(data_end, len(cut)) - start, 0) // file.frame
    size, length = file.data_size(len(file.data)), file.riff_size(len(whole) - 8)
    is_right = size == len(file.data) and length == len(whole) - 8
    try:
        samples, told = read(path)
    except InputError:
        assert not (is_right and there and share is None), "expected a right file to be read"
        return
    held = len(cut) - start
    if len(cut) < len(whole):
        # What is cut off by as much as a header that counts itself looks the same.
        assume(not 0 < size - held <= max(COUNTED[-1], start) or length + 8 == len(cut))
        # A chunk of which only some bytes are left is none, unless a right header says where.
        assume(len(cut) <= data_end or size == len(file.data))
    assert there, "expected a refusal"
    assert samples.shape == (there, file.channels)
    assert np.array_equal(samples, truth[:there])
    if size // file.frame != there:
        assert told, "expected to be told of a wrong header"
    if there < file.frames:
        assert size in OPEN or size <= held or length + 8 in (len(cut), len(cut) - 1)
