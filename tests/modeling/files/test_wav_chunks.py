"""WAV files whose headers are wrong: all samples that are there, said in words, or refused."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import soundfile
from hypothesis import assume, given
from hypothesis import strategies as st

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.files.wav import mended_wav, read_wav, read_wav_channels, samples_only
from tactileq.modeling.recordings.appending import WavSource, append
from tests.refusals import check_refusal, refused, warned

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


# --- Single cases ---------------------------------------------------------------------------------


def written(path: Path, file: Written, *, cut_to: int | None = None) -> tuple[Path, np.ndarray]:
    truth = file.truth(path)
    path.write_bytes(file.bytes()[0][:cut_to])
    return path, truth


@pytest.mark.parametrize("before", [(), ("LIST", "bext"), ("JUNK", "FLLR")])
@pytest.mark.parametrize(
    ("data_size", "riff_size"),
    [(none, none), (none, lower), (lower, lower), (right, none)]
    + [(SIZES[i], SIZES[i]) for i in range(3, 8)],
)
@pytest.mark.parametrize("after", [(), ("LIST",)])
def test_wrong_headers_of_whole_files(
    tmp_path: Path, before: tuple[str, ...], data_size: Sizes, riff_size: Sizes, after: tuple[str]
) -> None:
    file = Written(before=before, after=after, data_size=data_size, riff_size=riff_size)
    path, truth = written(tmp_path / "a.wav", file)
    samples, told = read(path)
    assert np.array_equal(samples, truth)
    assert len(told) == (data_size is not right)
    for sentence in told:
        check_refusal(sentence, names=["a.wav", "header", "500 samples"])


@pytest.mark.parametrize("form", ["RIFF", "RIFX", "RF64", "BW64"])
def test_cut_files_are_refused(tmp_path: Path, form: str) -> None:
    path, _ = written(tmp_path / "a.wav", Written(form=form), cut_to=640)
    with refused(InputError, expected=[path, "500 samples"], got=["640 bytes", "truncated"]):
        read_wav(path)
    with refused(InputError, expected=path, got="truncated"):
        samples_only(path.read_bytes(), path)


def test_a_cut_file_whose_own_size_is_right_is_told_of(tmp_path: Path) -> None:
    file = Written(riff_size=lambda size: 644 - 8)
    path, truth = written(tmp_path / "a.wav", file, cut_to=644)
    with warned(names=["a.wav", "500 samples", "300 samples"]):
        samples, _ = read_wav(path)
    assert np.array_equal(samples, truth[:300, 0])


@pytest.mark.parametrize("size", [right, none, SIZES[3]])
def test_a_file_without_samples_is_refused(tmp_path: Path, size: Sizes) -> None:
    path, _ = written(tmp_path / "a.wav", Written(frames=0, data_size=size))
    with refused(InputError, expected=path, got=["none", "header"]):
        read_wav(path)


@pytest.mark.parametrize("sound", [b"LIST\xff\xff\0\0", b"LIST\4\0\0\0INFO", b"abcd\2\0\0\0xy"])
def test_samples_that_look_like_a_chunk(tmp_path: Path, sound: bytes) -> None:
    """Behind the end that a stale header gives them."""
    noise = Written(frames=400).data
    file = Written(samples=noise[:400] + sound + noise[400:], data_size=lambda size: 400)
    path, truth = written(tmp_path / "a.wav", replace(file, riff_size=lambda size: 436))
    try:
        samples, told = read(path)
    except InputError as error:
        check_refusal(str(error), expected=path, got=["LIST"])
    else:
        assert np.array_equal(samples, truth)
        assert told


@pytest.mark.parametrize("is_padded", [True, False])
@pytest.mark.parametrize("after", [(), ("LIST",), ("id3", "Zzzz")])
def test_odd_samples(tmp_path: Path, is_padded: bool, after: tuple[str, ...]) -> None:
    file = Written(bits=24, frames=501, after=after, is_padded=is_padded)
    if not is_padded:
        file = replace(file, after=after[:1])
    path, truth = written(tmp_path / "a.wav", file)
    samples, told = read(path)
    assert np.array_equal(samples, truth)
    assert not told


def test_a_chunk_behind_the_samples_that_is_cut(tmp_path: Path) -> None:
    file = Written(after=("LIST",))
    path, truth = written(tmp_path / "a.wav", file, cut_to=len(file.bytes()[0]) - 5)
    assert np.array_equal(read(path)[0], truth)
    longer = bytearray(file.bytes()[0])
    longer[-19] = 200  # its size alone
    path.write_bytes(longer)
    assert np.array_equal(read(path)[0], truth)


def test_what_is_imported_reads_the_same_from_its_copy(tmp_path: Path) -> None:
    path, truth = written(tmp_path / "a.wav", Written(data_size=none, before=("JUNK",)))
    assert mended_wav(path) is not None
    record = Recording(truth[:, 0], 8000.0, 100.0, 1.0, "felt")
    append(tmp_path / "set", RecordingSet([record]), [WavSource(path)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (again,) = RecordingSet.load(tmp_path / "set").recordings
    assert np.array_equal(again.samples, truth[:, 0])
    assert soundfile.info(tmp_path / "set/0001.wav").frames == 500
    right_file, _ = written(tmp_path / "b.wav", Written(before=("JUNK",)))
    assert mended_wav(right_file) is None


def test_samples_alone_of_a_file_that_was_never_closed(tmp_path: Path) -> None:
    path, truth = written(tmp_path / "a.wav", Written(data_size=none, before=("LIST",)))
    (tmp_path / "b.wav").write_bytes(samples_only(path.read_bytes(), path))
    samples, told = read(tmp_path / "b.wav")
    assert np.array_equal(samples, truth)
    assert not told
