"""Pieces of C that every exported header is made of."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling import InputError
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.stimuli.exports.layered import Layered
from tactileq.stimuli.sets.recipe import HIGHEST_FILE_RATE_HZ

# Noise is within ±√3, and a band-pass adds up a few of its samples.
HEADROOM = 100.0
COPYRIGHT = "Copyright (C) 2026 the tactileq authors"
SINGLE_PRECISION = "#ifndef TQ_REAL\n#define TQ_REAL float\n#endif\n\n"


def source(header: str) -> str:
    """The text of one of the headers of `tactileq.modeling.rendering`."""
    return files("tactileq.modeling.rendering").joinpath(header).read_text(encoding="utf-8")


def licence(data: str) -> str:
    """How a header's comment begins; `data` says whose its numbers are."""
    return f"""\
/* SPDX-License-Identifier: GPL-3.0-or-later
   {COPYRIGHT}

   Anyone who distributes a program that includes this header distributes the renderer in it, and
   so has to offer the whole program, with its source, under the GNU General Public License,
   version 3 or later. {data}
"""


def check_rate(rate_hz: float) -> None:
    """Refuse an output rate beyond that of any converter."""
    if rate_hz > HIGHEST_FILE_RATE_HZ:
        raise InputError(
            f"expected an output rate of at most {HIGHEST_FILE_RATE_HZ} Hz, got "
            f"{rate_hz:g}; no converter is faster, so reduce it."
        )


def check_output(model: Layered, plan: RenderPlan) -> None:
    """Refuse gains that let the program's numbers grow beyond its precision."""
    highest = float(np.finfo(plan.precision).max)
    if np.isfinite(plan.limits.rms):  # that limit squares samples
        highest = float(np.sqrt(highest))
    highest /= HEADROOM
    with np.errstate(over="ignore"):
        gain = float(model.table.largest_gains.sum() * np.sqrt(plan.rate_hz / model.rate_hz))
    if not gain <= highest:
        raise InputError(
            f"expected gains that add up to at most {highest:.1g} {model.unit}, so that samples "
            f"stay finite in {'single' if plan.single else 'double'} precision, got {gain:.3g} "
            f"{model.unit}; correct the model."
        )


def identifier(kind: str, name: str) -> str:
    """Any name as an identifier in C: KIND_, letters, digits, _ for all else."""
    return f"{kind}_" + re.sub("[^A-Za-z0-9]", "_", name)


def arrays_of(members: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Those members of a `tq_texture` that are arrays."""
    return {member: value for member, value in members.items() if np.ndim(value)}


def initializer(members: Mapping[str, Any], arrays: Mapping[str, str], *, indent: int = 4) -> str:
    """The lines that initialize a `tq_texture`, given what its arrays are called."""
    lines = (
        f"{' ' * indent}.{member} = {arrays.get(member) or number(value)},\n"
        for member, value in members.items()
    )
    return "".join(lines)


def array(name: str, values: NDArray[Any]) -> str:
    """An array in C; each row of a table begins further to the left than its other lines."""
    rows = np.atleast_2d(values) if values.size else np.zeros((1, 1))  # C has no empty arrays
    fill = partial(textwrap.fill, width=100, initial_indent=" " * 4, subsequent_indent=" " * 8)
    lines = "".join(f"{fill(', '.join(map(number, row)))},\n" for row in rows)
    return f"static const tq_real {name}[] = {{\n{lines}}};\n\n"


def number(value: float | np.float32) -> str:
    """The shortest constant in C that is exactly this number."""
    if isinstance(value, int):
        return str(value)
    return f"{value!s}f" if isinstance(value, np.float32) else repr(float(value))


def restraints(plan: RenderPlan, unit: str) -> str:
    """What a header says of vibrator and limits."""
    notch, limits = plan.compensation, plan.limits
    vibrator = "Not compensated for a vibrator."
    if notch is not None:
        vibrator = f"Compensated for a vibrator with a resonance at {notch.frequency_hz:g} Hz."
    found = {"peak": (limits.peak, unit), "RMS": (limits.rms, unit)}
    found["duration"] = (limits.duration_s, "s")
    stated = [f"{what} {value:g} {of}" for what, (value, of) in found.items() if np.isfinite(value)]
    return f"{vibrator} Limits: {', '.join(stated) or 'none'}. Both are fields of tq_texture."


def quoted(text: str) -> str:
    """Any text within quotes and within a comment in C."""
    return commentable(json.dumps(text))


def commentable(text: str) -> str:
    """Any text within a comment in C."""
    return re.sub(r"(?<=\*)(?=/)|(?<=/)(?=\*)", " ", text)
