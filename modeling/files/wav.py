"""WAV files of one axis or several, and the meaning of their full scale."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.reading import check_file, read_bytes
from tactileq.modeling.files.wav_chunks import WAV_FORMS, held_samples

Tell = Callable[[str], object]

# First bytes of other sound files. In others libsndfile looks for MP3 and reports it on stderr.
_OTHER_FORMS = (b"riff", b"FORM", b"fLaC")
_LONGEST_FMT = 40  # of samples that are not encoded in blocks


def full_scale(value_g: float, file: str) -> float:
    """Acceleration (g) of a full-scale sample of `file`; InputError unless finite and above 0."""
    if not (np.isfinite(value_g) and value_g > 0):
        raise InputError(f"{file}: expected g per full scale above 0, got {value_g}; correct it.")
    return value_g


def read_wav(
    path: Path, *, channel: int | None = None, tell: Tell = warnings.warn
) -> tuple[Floats, float]:
    """Samples (n,), 1 = full scale, and rate (Hz) of one channel of a WAV file.

    Parameters
    ----------
    channel : int, optional
        Which one, from 1; may be left out where there is only one.
    tell : callable
        As of `read_wav_channels`.

    Raises
    ------
    InputError
        If the file is no readable WAV, is shorter than it says, has no such channel, or has several
        and none is chosen.
    """
    samples, rate_hz = read_wav_channels(path, tell=tell)
    count = samples.shape[1]
    if channel is None and count != 1:
        raise InputError(
            f"expected one channel in {path}, or a choice, got {count} and none chosen; name one "
            f"from 1 to {count} with --channel, or in a column 'channel' of the list of files."
        )
    chosen = 1 if channel is None else channel
    if not 1 <= chosen <= count:
        raise InputError(
            f"expected a channel from 1 to {count} of {path}, got {chosen}; choose one of those."
        )
    return np.ascontiguousarray(samples[:, chosen - 1]), rate_hz


def read_wav_channels(path: Path, *, tell: Tell = warnings.warn) -> tuple[Floats, float]:
    """Samples (n, channels), 1 = full scale, and rate (Hz) of a WAV file.

    Parameters
    ----------
    tell : callable
        Takes the sentence on a header that does not say how many samples the file holds.

    Raises
    ------
    InputError
        If the file is no readable WAV, or is shorter than it says.
    """
    import soundfile  # late: loads a shared library that most uses never need

    try:
        samples, rate_hz = soundfile.read(_sound(path, tell), dtype="float64", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise InputError(
            f"expected a WAV file, got {path} ({error.error_string.rstrip('.')}); convert it."
        ) from None
    except MemoryError:
        raise InputError(
            f"expected a WAV file that fits into memory, got {path}; cut it into parts."
        ) from None
    return samples, float(rate_hz)


def _sound(path: Path, tell: Tell) -> Path | BytesIO:
    """What libsndfile reads: WAV files with right sizes, and other sound files as they are."""
    check_file(path, "a WAV file")
    with path.open("rb") as file:
        form = file.read(4)
    if not form:
        raise InputError(f"expected a WAV file, got {path}, which is empty; record it again.")
    if form in _OTHER_FORMS:
        return path
    if form not in WAV_FORMS:
        raise InputError(f"expected a WAV file, got {path}, which holds no sound; convert it.")
    held = held_samples(read_bytes(path, "a WAV file"), path)
    if held.doubt:
        tell(held.doubt)
    return BytesIO(held.file())


def samples_only(data: bytes, path: Path) -> bytes:
    """A WAV file's format and samples, without what else it says: names, places, dates, pictures.

    A file that holds nothing else stays as it is.

    Parameters
    ----------
    data : bytes
        The whole file.
    path : Path
        Its place, for the message.

    Raises
    ------
    InputError
        As `held_samples`.
    """
    return held_samples(data, path).file(longest_fmt=_LONGEST_FMT)


def mended_wav(path: Path) -> bytes | None:
    """Format and samples of a WAV file whose sizes are wrong, with right ones; None of any other.

    Raises
    ------
    InputError
        As `held_samples`.
    """
    data = read_bytes(path, "a WAV file")
    held = held_samples(data, path) if data[:4] in WAV_FORMS else None
    return held.file() if held is not None and held.doubt else None
