"""WAV files of one axis or several, and the meaning of their full scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.reading import check_file

# What a WAV file needs to be one; `fact`, the number of samples, beside floats.
_NEEDED = {b"fmt ": 40, b"fact": 4, b"data": None}
# The first bytes of sound files. In others libsndfile would look for MP3 and report it on stderr.
_FORMS = (b"RIFF", b"RIFX", b"RF64", b"riff", b"FORM", b"fLaC")


def full_scale(value_g: float, file: str) -> float:
    """Acceleration (g) of a full-scale sample of `file`; InputError unless finite and above 0."""
    if not (np.isfinite(value_g) and value_g > 0):
        raise InputError(f"{file}: expected g per full scale above 0, got {value_g}; correct it.")
    return value_g


def read_wav(path: Path, *, channel: int | None = None) -> tuple[Floats, float]:
    """Samples (n,), 1 = full scale, and rate (Hz) of one channel of a WAV file.

    Parameters
    ----------
    channel : int, optional
        Which one, from 1; may be left out where there is only one.

    Raises
    ------
    InputError
        If the file is no readable WAV, is shorter than it says, has no such channel, or has several
        and none is chosen.
    """
    samples, rate_hz = read_wav_channels(path)
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


def read_wav_channels(path: Path) -> tuple[Floats, float]:
    """Samples (n, channels), 1 = full scale, and rate (Hz) of a WAV file.

    Raises
    ------
    InputError
        If the file is no readable WAV, or is shorter than it says.
    """
    import soundfile  # late: loads a shared library that most uses never need

    check_file(path, "a WAV file")
    with path.open("rb") as file:
        form, announced = file.read(4), int.from_bytes(file.read(4), "little") + 8
    if not form:
        raise InputError(f"expected a WAV file, got {path}, which is empty; record it again.")
    if form not in _FORMS:
        raise InputError(f"expected a WAV file, got {path}, which holds no sound; convert it.")
    try:
        samples, rate_hz = soundfile.read(path, dtype="float64", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise InputError(
            f"expected a WAV file, got {path} ({error.error_string.rstrip('.')}); convert it."
        ) from None
    except MemoryError:
        raise InputError(
            f"expected a WAV file that fits into memory, got {path}; cut it into parts."
        ) from None
    # Streaming recorders write 0 or about the largest size there is; a last pad byte may lack.
    if form == b"RIFF" and path.stat().st_size + 1 < announced and 8 < announced < 0x7FFF0000:
        raise InputError(
            f"expected {announced} bytes in {path}, as its header says, got "
            f"{path.stat().st_size}; the file is truncated, copy or record it again."
        )
    return samples, float(rate_hz)


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
        If it is no RIFF/WAVE file with a format and samples.
    """
    kept, at = {}, 12
    if data[:4] == b"RIFF" and data[8:12] == b"WAVE":
        while at + 8 <= len(data) and b"data" not in kept:
            name, size = data[at : at + 4], int.from_bytes(data[at + 4 : at + 8], "little")
            if name in _NEEDED:
                kept[name] = data[at + 8 : at + 8 + size][: _NEEDED[name]]
            at += 8 + size + size % 2
    if not (kept.get(b"fmt ") and kept.get(b"data")):
        raise InputError(
            f"expected a WAV file (RIFF) with a format and samples at {path}, got something else; "
            "convert it."
        )
    chunks = (n + len(c).to_bytes(4, "little") + c + bytes(len(c) % 2) for n, c in kept.items())
    body = b"WAVE" + b"".join(chunks)
    return b"RIFF" + len(body).to_bytes(4, "little") + body
