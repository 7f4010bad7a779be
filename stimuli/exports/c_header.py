"""A model and the kernel as one C header."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactileq.modeling import Compensation, Limits
from tactileq.modeling.checks import check_name
from tactileq.modeling.errors import counted
from tactileq.modeling.files.writing import write_text
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import RenderPlan, plan_for, usual_update_s
from tactileq.stimuli.exports.c_source import (
    SINGLE_PRECISION,
    array,
    arrays_of,
    check_output,
    check_rate,
    identifier,
    initializer,
    licence,
    quoted,
    restraints,
    source,
)
from tactileq.stimuli.exports.layered import Layered, check_layered

NUMBERS = """\
The numbers of the texture are data of those whose model it is; that licence does not
   cover them."""


def write_c_header(
    path: str | Path,
    model: AnyModel,
    *,
    rate_hz: float | None = None,
    seed: int = 0,
    single: bool = False,
    limits: Limits | None = None,
    compensation: Compensation | None = None,
    name: str | None = None,
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
    rate_hz : float, optional
        Output rate, from the model's (the default) to 768 000 Hz.
    single : bool
        Single precision: tables as the nearest floats, and TQ_REAL is float unless the program
        defines it otherwise.
    limits : Limits, optional
        None by default.
    compensation : Compensation, optional
        Of the vibrator that plays the output, at its rate.
    name : str, optional
        Instead of the texture's name, which two headers of one texture cannot share.

    Returns
    -------
    str
        NAME: texture_ and that name, with _ for all but letters and digits.

    Raises
    ------
    InputError
        For an autoregressive model, a rate out of range, a compensation for another rate, gains
        with which samples would not stay finite, or, in single precision, numbers that it cannot
        hold or tell apart.
    """
    named, text = c_header(
        Path(path).name,
        model,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        limits=limits,
        compensation=compensation,
        name=name,
    )
    write_text(path, text)
    return named


def c_header(
    file_name: str,
    model: AnyModel,
    *,
    rate_hz: float | None = None,
    seed: int = 0,
    single: bool = False,
    limits: Limits | None = None,
    compensation: Compensation | None = None,
    name: str | None = None,
) -> tuple[str, str]:
    """NAME and the text of the header that `write_c_header` writes; refused as there."""
    layered = check_layered(model)
    if name is not None:
        check_name("the name of the texture in the header", name)
    name = c_identifier(layered.texture if name is None else name)
    if rate_hz is not None:
        check_rate(rate_hz)
    plan = plan_for(
        layered.rate_hz,
        rate_hz=rate_hz,
        update_s=usual_update_s(layered),
        limits=limits,
        compensation=compensation,
        single=single,
    )
    members: Mapping[str, Any] = plan.texture(layered)
    check_output(layered, plan)
    precision = SINGLE_PRECISION if single else ""
    tables = _tables(name, members)
    key = f"static const uint64_t {name}_key = UINT64_C({int(stream_key(seed)):#x});\n"
    comment = _comment(layered, plan, name=name, file_name=file_name, seed=seed)
    # Two exports of one name in one program: the same twice is one, others the compiler refuses.
    guard = f"{name}_{hashlib.sha256((tables + key).encode()).hexdigest()[:16]}"
    opening, closing = f"#ifndef {guard}\n#define {guard}\n\n", "\n#endif\n"
    return name, "".join(
        [comment, opening, precision, source("kernel.h"), "\n", tables, key, closing]
    )


def c_identifier(texture: str) -> str:
    """A texture's name as an identifier in C: texture_, letters, digits, _ for all else."""
    return identifier("texture", texture)


def _tables(name: str, members: Mapping[str, Any]) -> str:
    """The arrays of a texture, the texture itself and the memory that it needs, in C."""
    arrays = arrays_of(members)
    entries = initializer(members, {member: f"{name}_{member}" for member in arrays})
    memory = f"TQ_MEMORY({members['layers']}, {members.get('up', 0)})"
    return "".join(
        [
            *(array(f"{name}_{member}", value) for member, value in arrays.items()),
            f"static const tq_texture {name} = {{\n{entries}}};\n\n",
            f"enum {{ {name}_memory = {memory} }};\n",
        ]
    )


def _origin(model: Layered) -> str:
    """Where the table's grid comes from, where it is not that of the recordings."""
    stored = model.table.speeds_mm_s.size, model.table.forces_n.size
    made_at = model.speeds_mm_s.size, model.forces_n.size
    if stored == made_at:
        return ""
    return (
        f",\n   stored at {stored[0]} x {stored[1]} places, so that they blend as the model made "
        f"at {made_at[0]} x {made_at[1]} conditions does"
    )


def _comment(model: Layered, plan: RenderPlan, *, name: str, file_name: str, seed: int) -> str:
    speeds, forces = model.table.speeds_mm_s, model.table.forces_n
    made = "simulated" if model.simulated else "from recordings"
    return f"""\
{licence(NUMBERS)}
   Texture {quoted(model.texture)}, {made}, for rendering in C99: output in {model.unit} at \
{plan.rate_hz:g} Hz, seed {seed}.

   {counted(model.n_layers, "layer")} ({quoted(model.estimator)}) over \
{counted(speeds.size, "speed")}, {speeds[0]:g} to {speeds[-1]:g} mm/s, and \
{counted(forces.size, "force")}, {forces[0]:g} to {forces[-1]:g} N\
{_origin(model)}.
   Model: SHA-256 {model.sha256}

   cc -std=c99 -O2 -ffp-contract=off -fno-math-errno PROGRAM.c -lm, never with -ffast-math.
   What else can be defined, and C++17, freestanding: below. A program:

       #include <stdio.h>
       #include {quoted(file_name)}
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

   {restraints(plan, model.unit)} */

"""
