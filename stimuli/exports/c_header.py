"""A model and the kernel as one C header."""

from __future__ import annotations

import hashlib
import json
import re
import textwrap
from collections.abc import Mapping
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modeling import Compensation, InputError, Limits
from modeling.files.writing import write_text
from modeling.models.loading import AnyModel
from modeling.rendering.noise import stream_key
from modeling.rendering.plan import RenderPlan, plan_for
from stimuli.exports.layered import Layered, check_layered
from stimuli.sets.recipe import HIGHEST_RATE_HZ

# Noise is within ±√3, and a band-pass adds up a few of its samples.
HEADROOM = 100.0
COPYRIGHT = "Copyright (C) 2026 the tactileq authors"


def write_c_header(
    path: str | Path,
    model: AnyModel,
    *,
    rate_hz: float | None = None,
    seed: int = 0,
    single: bool = False,
    limits: Limits | None = None,
    compensation: Compensation | None = None,
) -> str:
    """Write one C99 header that renders a model and needs nothing else: tables and kernel.

    It defines `NAME` (a `tq_texture`), `NAME_memory` (how many reals of memory a state needs) and
    `NAME_key` (of the noise); a comment on top shows their use. In double precision its output is
    that of a `Renderer` with the same arguments bit for bit; in single precision it differs by
    rounding. Headers of several textures go into one program, which then holds the kernel and comes
    under its licence, GPL-3.0-or-later; the header says so.

    Parameters
    ----------
    path : path
        The header; there whole or not at all.
    model : TextureModel or RegressedModel
    rate_hz : float, optional
        Output rate, from the model's (the default) to 768 000 Hz.
    seed : int
    single : bool
        Single precision: tables as the nearest floats, and TQ_REAL is float unless the program
        defines it otherwise.
    limits : Limits, optional
        None by default.
    compensation : Compensation, optional
        Of the vibrator that plays the output, at its rate.

    Returns
    -------
    str
        NAME, from the texture's.

    Raises
    ------
    InputError
        For an autoregressive model, a rate out of range, a compensation for another rate, gains
        with which samples would not stay finite, or, in single precision, numbers that it cannot
        hold or tell apart.
    """
    name, text = c_header(
        Path(path).name,
        model,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        limits=limits,
        compensation=compensation,
    )
    write_text(path, text)
    return name


def c_header(
    file_name: str,
    model: AnyModel,
    *,
    rate_hz: float | None = None,
    seed: int = 0,
    single: bool = False,
    limits: Limits | None = None,
    compensation: Compensation | None = None,
) -> tuple[str, str]:
    """NAME and the text of the header that `write_c_header` writes; refused as there."""
    layered = check_layered(model)
    name = c_identifier(layered.texture)
    _check_rate(rate_hz)
    plan = plan_for(
        layered.rate_hz,
        rate_hz=rate_hz,
        limits=limits,
        compensation=compensation,
        single=single,
    )
    members: Mapping[str, Any] = plan.texture(layered)
    _check_output(layered, plan)
    kernel = files("modeling.rendering").joinpath("kernel.h").read_text(encoding="utf-8")
    precision = "#ifndef TQ_REAL\n#define TQ_REAL float\n#endif\n\n" if single else ""
    tables = _tables(name, members)
    key = f"static const uint64_t {name}_key = UINT64_C({int(stream_key(seed)):#x});\n"
    comment = _comment(layered, plan, name=name, file_name=file_name, seed=seed)
    # Two exports of one name in one program: the same twice is one, others the compiler refuses.
    guard = f"{name}_{hashlib.sha256((tables + key).encode()).hexdigest()[:16]}"
    opening, closing = f"#ifndef {guard}\n#define {guard}\n\n", "\n#endif\n"
    return name, "".join([comment, opening, precision, kernel, "\n", tables, key, closing])


def _check_rate(rate_hz: float | None) -> None:
    if rate_hz is not None and rate_hz > HIGHEST_RATE_HZ:
        raise InputError(
            f"expected an output rate of at most {HIGHEST_RATE_HZ} Hz, got {rate_hz:g}; no "
            "converter is faster, so lower it."
        )


def _check_output(model: Layered, plan: RenderPlan) -> None:
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


def c_identifier(texture: str) -> str:
    """A texture's name as an identifier in C: texture_, letters, digits, _ for all else."""
    return "texture_" + re.sub("[^A-Za-z0-9]", "_", texture)


def _tables(name: str, members: Mapping[str, Any]) -> str:
    """The arrays of a texture, the texture itself and the memory that it needs, in C."""
    arrays = {member: value for member, value in members.items() if np.ndim(value)}
    scalars = {
        member: str(value) if isinstance(value, int) else _literal(value)
        for member, value in members.items()
        if member not in arrays
    }
    entries = [f"    .{m} = {scalars.get(m, f'{name}_{m}')},\n" for m in members]
    return "".join(
        [
            *(_array(f"{name}_{member}", value) for member, value in arrays.items()),
            f"static const tq_texture {name} = {{\n{''.join(entries)}}};\n\n",
            f"enum {{ {name}_memory = TQ_MEMORY({scalars['layers']}, {scalars['taps']}) }};\n",
        ]
    )


def _array(name: str, values: NDArray[Any]) -> str:
    """An array in C; each row of a table begins further to the left than its other lines."""
    rows = np.atleast_2d(values) if values.size else np.zeros((1, 1))  # C has no empty arrays
    fill = partial(textwrap.fill, width=100, initial_indent=" " * 4, subsequent_indent=" " * 8)
    lines = "".join(f"{fill(', '.join(map(_literal, row)))},\n" for row in rows)
    return f"static const tq_real {name}[] = {{\n{lines}}};\n\n"


def _literal(number: float | np.float32) -> str:
    """The shortest constant in C that is exactly this number."""
    return f"{number!s}f" if isinstance(number, np.float32) else repr(float(number))


def _comment(model: Layered, plan: RenderPlan, *, name: str, file_name: str, seed: int) -> str:
    speeds, forces = model.table.speeds_mm_s, model.table.forces_n
    made = "simulated" if model.simulated else "from recordings"
    return f"""\
/* SPDX-License-Identifier: GPL-3.0-or-later
   {COPYRIGHT}

   Whoever passes on a program that includes this header passes on the renderer in it, and so has
   to offer the whole program, with its source, under the GNU General Public License, version 3 or
   later. The numbers of the texture are data of those whose model it is; that licence does not
   cover them.

   Texture {_quoted(model.texture)}, {made}, for rendering in C99: output in {model.unit} at \
{plan.rate_hz:g} Hz, seed {seed}.

   {model.n_layers} layers ({_quoted(model.estimator)}) over {speeds.size} speeds, {speeds[0]:g} \
to {speeds[-1]:g} mm/s, and {forces.size} forces, {forces[0]:g} to {forces[-1]:g} N.
   Model: SHA-256 {model.sha256}

   cc -std=c99 -O2 -ffp-contract=off -fno-math-errno PROGRAM.c -lm, never with -ffast-math.
   What else can be defined, and C++17, freestanding: below. A program:

       #include <stdio.h>
       #include {_quoted(file_name)}
       int main(void)
       {{
           static tq_real memory[{name}_memory], speed[500], force[500], out[500];
           static tq_state state;
           int n;
           for (n = 0; n < 500; n++) speed[n] = {speeds[0]:g}, force[n] = (tq_real){forces[0]:g};
           tq_start(&{name}, &state, memory, {name}_key);
           tq_render(&{name}, &state, speed, force, out, 500);
           for (n = 0; n < 500; n++) printf("%.9g\\n", (double)out[n]);
           return 0;
       }}

   {_restraints(plan, model.unit)} */

"""


def _restraints(plan: RenderPlan, unit: str) -> str:
    """What the header says of vibrator and limits."""
    notch, limits = plan.compensation, plan.limits
    vibrator = "Not compensated for a vibrator."
    if notch is not None:
        vibrator = f"Compensated for a vibrator with a resonance at {notch.frequency_hz:g} Hz."
    found = {"peak": (limits.peak, unit), "RMS": (limits.rms, unit)}
    found["duration"] = (limits.duration_s, "s")
    told = [f"{what} {value:g} {of}" for what, (value, of) in found.items() if np.isfinite(value)]
    return f"{vibrator} Limits: {', '.join(told) or 'none'}. Both are fields of tq_texture."


def _quoted(text: str) -> str:
    """Any text within quotes and within a comment in C."""
    return re.sub(r"(?<=\*)(?=/)|(?<=/)(?=\*)", " ", json.dumps(text))
