"""The only way in which files are read: as a whole, and only regular files."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

from tactileq.modeling.errors import InputError, shortened

LONGEST_PATH = 200
_REASONS = {
    errno.ENOENT: "nothing there",
    errno.ENOTDIR: "nothing there",
    errno.ELOOP: "a link that points back to itself",
    errno.EACCES: "no permission",
    errno.EPERM: "no permission",
    errno.ENAMETOOLONG: "a name that is too long",
    errno.EISDIR: "a folder",
    errno.EEXIST: "a file in the way",
    errno.EFBIG: "a file that is larger than it may be",
    errno.ENOSPC: "a full disk",
    errno.EROFS: "a full disk or one that refuses writes",
    errno.EIO: "a disk that fails",
}


def check_file(path: Path, what: str, *, advice: str = "give its path") -> None:
    """Refuse anything but a regular file, or a link to one, before it is opened.

    A pipe would wait for its other end indefinitely, and a device may never end.

    Parameters
    ----------
    what : str
        What is expected there, with its article, such as "a recipe".
    advice : str
        What to do; the end of the message.

    Raises
    ------
    InputError
    """
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise _refused(path, what, reason_of(error), advice=advice) from None
    except ValueError:  # a null character, which no system's call takes
        raise _refused(path, what, "a name that no file can have", advice=advice) from None
    if stat.S_ISDIR(mode):
        raise _refused(path, what, "a folder", advice=advice)
    if not stat.S_ISREG(mode):
        raise _refused(path, what, "a pipe, a socket or a device", advice=advice)


def read_bytes(path: Path, what: str) -> bytes:
    """The contents of a file; InputError naming `what` is expected where they cannot be read."""
    check_file(path, what)
    try:
        return path.read_bytes()
    except OSError as error:
        raise _refused(path, what, reason_of(error), advice="give its path") from None


def read_text(path: Path, what: str) -> str:
    r"""The text of a UTF-8 file, without a byte order mark and with \n at all line ends.

    Raises
    ------
    InputError
        Naming `what` is expected, where the file cannot be read or holds other bytes.
    """
    try:
        text = read_bytes(path, what).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            f"expected {what} as text in {path}, got other bytes; save it as UTF-8."
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def reason_of(error: OSError) -> str:
    """What the system's refusal to read or write a file means, in words."""
    return _REASONS.get(error.errno or 0, f"the refusal {error.strerror or error}")


def _refused(path: Path, what: str, got: str, *, advice: str) -> InputError:
    shown = shortened(str(path), longest=LONGEST_PATH)
    return InputError(f"expected {what} at {shown}, got {got}; {advice}.")
