"""Textures of a scene and the kernel as one C header: a hand switches between them."""

from __future__ import annotations

import hashlib
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from numpy.typing import NDArray

from tactileq.modeling import CompiledScene, InputError
from tactileq.modeling.errors import counted
from tactileq.modeling.rendering.noise import seed_mix
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.stimuli.exports.c_source import (
    SINGLE_PRECISION,
    array,
    arrays_of,
    check_output,
    check_rate,
    commentable,
    identifier,
    initializer,
    licence,
    quoted,
    restraints,
    source,
)
from tactileq.stimuli.exports.layered import Layered

Rendered = Sequence[tuple[Layered, RenderPlan]]

NUMBERS = """\
The numbers of the textures are data of those whose models they are; that licence does
   not cover them."""
# Of a plan, what the hand and the actuator keep over a switch.
_SHARED = {
    "rate_hz": "rate",
    "single": "precision",
    "compensation": "compensation",
    "limits": "set of limits",
}


def scene_identifier(name: str) -> str:
    """A scene's name as an identifier in C: scene_, letters, digits, _ for all else."""
    return identifier("scene", name)


def scene_header(
    file_name: str, name: str, rendered: Rendered, *, seed: int = 0, note: str = ""
) -> str:
    """One C99 header that renders the textures of a scene and needs nothing else.

    With NAME = `scene_identifier(name)` it defines `NAME` (a `tq_scene`, whose `tq_texture`s are
    `NAME_textures`), an enumeration of their indices (`NAME_texture_…`, in the order of `rendered`,
    and `NAME_count`) and `NAME_memory` (how many reals of memory a hand needs). A comment on top
    shows their use. Arrays that are equal bit for bit are held once.

    In double precision the output before the first switch is that of a `Renderer` of the seed, bit
    for bit; after switch n that of one of the same seed and stream n that is first fed force 0 for
    one parameter update (docs/method/rendering.md#scenes).

    Parameters
    ----------
    file_name : str
        Of the header, for the program in its comment.
    name : str
        The scene's.
    rendered : sequence of (TextureModel or RegressedModel, RenderPlan)
        Each model with how it is rendered: at one rate, in one precision, and with one compensation
        and the same limits; update periods may differ.
    seed : int
        Of the noise, 0 … 2⁶⁴ − 1.
    note : str
        Stated in the comment.

    Raises
    ------
    InputError
        For no texture, different rates, precisions, compensations, limits or units, a rate below a
        model's or beyond any converter's, gains with which samples would not stay finite, or, in
        single precision, numbers that it cannot hold or tell apart.
    """
    _check(rendered)
    scene = scene_identifier(name)
    plan = rendered[0][1]
    precision = SINGLE_PRECISION if plan.single else ""
    indices = _indices(scene, (model.texture for model, _ in rendered))
    textures = [plan.texture(model) for model, plan in rendered]
    tables = _tables(scene, indices, textures, noise=int(seed_mix(seed)))
    comment = "".join(
        [
            licence(NUMBERS),
            _about(name, rendered, seed=seed, note=note),
            _listed(indices, rendered),
            _program(file_name, scene, indices, rendered),
            f"   {restraints(plan, rendered[0][0].unit)} */\n\n",
        ]
    )
    # Two scenes of one name in one program: the same twice is one, others the compiler refuses.
    guard = f"{scene}_{hashlib.sha256(tables.encode()).hexdigest()[:16]}"
    opening, closing = f"#ifndef {guard}\n#define {guard}\n\n", "\n#endif\n"
    sources = [source("kernel.h"), "\n", source("scene.h"), "\n"]
    return "".join([comment, opening, precision, *sources, tables, closing])


# --- Checks ---------------------------------------------------------------------------------------


def compiled_header(compiled: CompiledScene, file_name: str, *, seed: int) -> str:
    """All textures of a compiled scene as one header, in single precision where all may be."""
    scene = compiled.scene
    bound = ", ".join(f"{measure} {value:g}" for measure, value in scene.bound.to_dict().items())
    note = (
        f"Compiled for the scene with SHA-256 {scene.sha256}; bound: {bound}. Beyond the scene the "
        "nearest edge is rendered, and samples are counted (above_grid, below_grid)."
    )
    return scene_header(file_name, scene.name, compiled.rendered, seed=seed, note=note)


def _check(rendered: Rendered) -> None:
    """Refuse what one hand cannot switch between."""
    if not rendered:
        raise InputError("expected at least one texture in a scene, got none; name one.")
    first, plan = rendered[0]
    check_rate(plan.rate_hz)
    for model, other in rendered:
        differ = [
            what for name, what in _SHARED.items() if getattr(plan, name) != getattr(other, name)
        ]
        differ += ["unit"] * (first.unit != model.unit)
        if differ:
            raise InputError(
                f"expected the same {differ[0]} for all textures of a scene, got another for "
                f"{model.texture} than for {first.texture}; make them equal."
            )
        check_output(model, other)


# --- Tables ---------------------------------------------------------------------------------------


def _indices(scene: str, textures: Iterable[str]) -> list[str]:
    """What the textures' indices are called; names that C would confuse are numbered."""
    found: list[str] = []
    for texture in textures:
        plain = f"{scene}_{identifier('texture', texture)}"
        names = (plain if n == 1 else f"{plain}_{n}" for n in range(1, len(found) + 2))
        found.append(next(name for name in names if name not in found))
    return found


def _tables(
    scene: str, indices: Sequence[str], textures: Sequence[Mapping[str, Any]], *, noise: int
) -> str:
    """All arrays, the textures, their indices, the scene and the memory that a hand needs, in C."""
    pool = _ArrayPool(scene)
    entries = [initializer(members, pool.names_of(members), indent=8) for members in textures]
    reals = _largest(textures)
    return "".join(
        [
            *(array(name, values) for name, values in pool.arrays),
            f"static const tq_texture {scene}_textures[] = {{\n",
            *(f"    {{\n{lines}    }},\n" for lines in entries),
            "};\n\nenum {\n",
            *(f"    {name},\n" for name in indices),
            f"    {scene}_count\n}};\n\n",
            f"static const tq_scene {scene} = {{\n    {scene}_textures, {scene}_count, "
            f"UINT64_C({noise:#x})\n}};\n\n",
            f"enum {{ {scene}_memory = {reals} }};\n",
        ]
    )


class _ArrayPool:
    """Arrays of several textures, those that are equal bit for bit once."""

    def __init__(self, scene: str) -> None:
        self._scene = scene
        self._found: dict[tuple[str, bytes], tuple[str, NDArray[Any]]] = {}

    @property
    def arrays(self) -> list[tuple[str, NDArray[Any]]]:
        """Their names in C with their values."""
        return list(self._found.values())

    def names_of(self, members: Mapping[str, Any]) -> dict[str, str]:
        """What the arrays of a texture are called; NULL where there is nothing in one."""
        return {
            member: self._name_of(values) if values.size else "NULL"
            for member, values in arrays_of(members).items()
        }

    def _name_of(self, values: NDArray[Any]) -> str:
        new = f"{self._scene}_array_{len(self._found) + 1}", values
        return self._found.setdefault((values.dtype.str, values.tobytes()), new)[0]


def _largest(textures: Sequence[Mapping[str, Any]]) -> str:
    """The largest memory that any of the textures needs, in C; lanes are known only there."""
    most: dict[bool, tuple[int, int]] = {}  # layers and `up` by whether there is interpolation
    for members in textures:
        size = members["layers"], members.get("up", 0)
        most[size[1] > 0] = max(size, most.get(size[1] > 0, size))
    if True in most and False in most and most[False][0] <= most[True][0]:
        del most[False]
    sizes = [f"TQ_MEMORY({layers}, {up})" for layers, up in most.values()]
    return sizes[0] if len(sizes) == 1 else f"TQ_LARGER({sizes[0]}, {sizes[1]})"


# --- Comment --------------------------------------------------------------------------------------


def _about(name: str, rendered: Rendered, *, seed: int, note: str) -> str:
    model, plan = rendered[0]
    count = counted(len(rendered), "texture")
    remark = f"\n{_commented(note)}\n" if note else ""
    return f"""
   Scene {quoted(name)}, {count}, for rendering in C99: output in {model.unit} at \
{plan.rate_hz:g} Hz, seed {seed}.
{remark}
"""


def _listed(indices: Sequence[str], rendered: Rendered) -> str:
    return "".join(
        _described(index, model, plan)
        for index, (model, plan) in zip(indices, rendered, strict=True)
    )


def _described(index: str, model: Layered, plan: RenderPlan) -> str:
    speeds, forces = model.table.speeds_mm_s, model.table.forces_n
    made = "simulated" if model.simulated else "from recordings"
    layers = counted(model.n_layers, "layer")
    period = "sample" if plan.update_samples == 1 else f"{plan.update_samples} samples"
    return f"""\
   {index}: {quoted(model.texture)}, {made}
       {layers} ({quoted(model.estimator)}) over {counted(speeds.size, "speed")}, {speeds[0]:g} to \
{speeds[-1]:g} mm/s, and {counted(forces.size, "force")}, {forces[0]:g} to {forces[-1]:g} N;
       parameters updated every {period}.
       Model: SHA-256 {model.sha256}
"""


def _program(file_name: str, scene: str, indices: Sequence[str], rendered: Rendered) -> str:
    table = rendered[0][0].table
    speed, force = table.speeds_mm_s[0], table.forces_n[0]
    return f"""
   cc -std=c99 -O2 -ffp-contract=off -fno-math-errno PROGRAM.c -lm, never with -ffast-math.
   What else can be defined, and C++17, freestanding: below. A program:

       #include <stdio.h>
       #include {quoted(file_name)}
       int main(void)
       {{
           static tq_real memory[{scene}_memory], out[1000];
           static tq_scene_hand hand;
           int n;
           tq_scene_start(&hand, &{scene}, memory, 0, {indices[0]});
           tq_scene_render_held(&hand, (tq_real){speed:g}, (tq_real){force:g}, out, 500);
           tq_scene_switch(&hand, {indices[-1]});
           tq_scene_render_held(&hand, (tq_real){speed:g}, (tq_real){force:g}, out + 500, 500);
           for (n = 0; n < 1000; n++) printf("%.9g\\n", (double)out[n]);
           return 0;
       }}

"""


def _commented(text: str) -> str:
    """Any text as lines of a comment in C."""
    fill = partial(textwrap.fill, width=97, initial_indent=" " * 3, subsequent_indent=" " * 3)
    return "\n".join(map(fill, commentable(text).splitlines()))
