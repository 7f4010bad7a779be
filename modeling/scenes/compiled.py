"""A compiled scene: a model for each texture, what it costs and how well it keeps the bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import acos
from pathlib import Path
from typing import Any, Literal

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.documents import dump_json, read_json_object
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.writing import file_stem, write_text
from tactileq.modeling.models.loading import Layered, load_model
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.rendering.cost import Cost
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.modeling.rendering.renderer import Renderer
from tactileq.modeling.reprs import one_line
from tactileq.modeling.scenes.cost import Rendered, in_one_precision, scene_bytes
from tactileq.modeling.scenes.scene import Scene

FORMAT = "tactileq.compiled-scene"
VERSION = 1
FILE = "scene.json"
Way = Literal["grid", "regression", "centroid"]
Measure = Literal["gfc30", "bands_db", "level_db"]


@dataclass(frozen=True)
class Measured:
    """One measure of a compiled model, over the places of the scene.

    Parameters
    ----------
    measure : {"gfc30", "bands_db", "level_db"}
    mean : float
        With the hand at rest at each place, weighted by its time there; of dB the RMS.
    worst : float
        The worst place that counts, everything together: blending, late updates, precision.
    place : str
        Which one.
    of_full : float
        The worst against the full model, whose layers that are not felt are gone.
    """

    measure: Measure
    bound: float
    mean: float
    worst: float
    place: str
    of_full: float

    @property
    def share(self) -> float:
        """Of the bound that the worst place takes; of a GFC, of the angle whose cosine it is."""
        worst, bound = self.worst, self.bound
        if self.measure == "gfc30":
            worst, bound = acos(worst), acos(bound)
        return worst / bound if bound else 0.0


@dataclass(frozen=True)
class Step:
    """One step of the compiler, and what a texture costs after it and those before it.

    Parameters
    ----------
    layers, numbers, bytes : int
        Of tables and a state.
    operations : float
        Per sample.
    share : float
        Of the bound, that of the measure and place which take most; 1 is all of it.
    """

    step: str
    layers: int
    numbers: int
    bytes: int
    operations: float
    share: float


@dataclass(frozen=True)
class Alternative:
    """A longer update interval: what it would cost per sample, and take of the bound (above 1)."""

    update_ms: float
    operations: float
    share: float


@dataclass(frozen=True, eq=False, kw_only=True)
class CompiledTexture:
    """The compiled model of one texture: the cheapest one that keeps the bound.

    Parameters
    ----------
    full : TextureModel
        What it was compiled from.
    felt : TextureModel
        The full model without the layers that nobody can feel in the scene: what the bound is
        measured against.
    model : TextureModel or RegressedModel
        The least one, which names the scene in `compiled_for`.
    dropped : tuple of int
        Layers of the full model, from 1.
    way : {"grid", "regression", "centroid"}
        What drives its parameters.
    full_plan, plan : RenderPlan
        How the full and the least model are rendered: by default every millisecond in double
        precision; and as the compiler chose.
    refused : Alternative, optional
        The next longer update interval; None where there is none.
    """

    full: TextureModel
    felt: TextureModel
    model: Layered
    dropped: tuple[int, ...]
    way: Way
    full_plan: RenderPlan
    plan: RenderPlan
    measures: tuple[Measured, ...]
    steps: tuple[Step, ...]
    refused: Alternative | None

    @property
    def texture(self) -> str:
        """Its name."""
        return self.full.texture

    @property
    def before(self) -> Cost:
        """Of rendering the full model."""
        return self.full_plan.cost(self.full)

    @property
    def after(self) -> Cost:
        """Of rendering the least one."""
        return self.plan.cost(self.model)

    def renderer(self, *, seed: int = 0, stream: int = 0) -> Renderer:
        """A renderer of the least model, within the actuator's limits."""
        return Renderer(
            self.model,
            rate_hz=self.plan.rate_hz,
            seed=seed,
            stream=stream,
            update_samples=self.plan.update_samples,
            limits=self.plan.limits,
            single=self.plan.single,
        )


@dataclass(frozen=True, eq=False)
class CompiledScene:
    """The compiled models of all textures of a scene."""

    scene: Scene
    textures: tuple[CompiledTexture, ...]

    __repr__ = one_line

    @property
    def models(self) -> dict[str, Layered]:
        """By the name of their texture."""
        return {compiled.texture: compiled.model for compiled in self.textures}

    @property
    def bytes_before(self) -> int:
        """Of the tables and states of all full models, each by itself."""
        return sum(compiled.before.bytes for compiled in self.textures)

    @property
    def bytes_after(self) -> int:
        """Of the least models together: what they share and a hand's state are stored once."""
        return scene_bytes(self.rendered)

    @property
    def rendered(self) -> list[Rendered]:
        """Each least model with its plan, all in one precision, as one program renders them."""
        return in_one_precision((compiled.model, compiled.plan) for compiled in self.textures)

    @property
    def operations_before(self) -> float:
        """Per sample, of the full model that takes most."""
        return max(compiled.before.operations for compiled in self.textures)

    @property
    def operations_after(self) -> float:
        """Per sample, of the least model that takes most."""
        return max(compiled.after.operations for compiled in self.textures)

    def save(self, folder: str | Path) -> None:
        """Write each model as TEXTURE.json, and scene.json, which says what they are for.

        Raises
        ------
        InputError
            If two textures would have one file.
        """
        names = [f"{file_stem(compiled.texture)}.json" for compiled in self.textures]
        if FILE in names or len(set(names)) < len(names):
            raise InputError(
                f"expected textures whose files have different names, none of them {FILE}, got "
                f"{', '.join(names)}; rename a texture."
            )
        for name, compiled in zip(names, self.textures, strict=True):
            compiled.model.save(Path(folder) / name)
        write_text(Path(folder) / FILE, dump_json(self.to_dict()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values of scene.json: the scene, and each texture's models, costs and measures."""
        values = {
            "format": FORMAT,
            "version": VERSION,
            "scene": self.scene.to_dict(),
            "scene_sha256": self.scene.sha256,
            "simulated": any(compiled.full.simulated for compiled in self.textures),
            "bytes_before": self.bytes_before,
            "bytes_after": self.bytes_after,
            "textures": [_texture_values(compiled) for compiled in self.textures],
        }
        return {**values, "sha256": sha256_of_values(values)}


def _texture_values(compiled: CompiledTexture) -> dict[str, Any]:
    return {
        "texture": compiled.texture,
        "full_sha256": compiled.full.sha256,
        "model_sha256": compiled.model.sha256,
        "dropped": list(compiled.dropped),
        "way": compiled.way,
        "update_samples": compiled.plan.update_samples,
        "single": compiled.plan.single,
        "operations": compiled.after.operations,
        "measures": [asdict(measured) for measured in compiled.measures],
    }


def load_compiled(
    folder: str | Path, full: Mapping[str, TextureModel] | None = None
) -> dict[str, Layered]:
    """The models of a scene that was compiled into a folder, by the name of their texture.

    Parameters
    ----------
    folder : path
        As `CompiledScene.save` wrote it.
    full : mapping, optional
        The full models of today; each compiled model must come from the one of its texture.

    Raises
    ------
    InputError
        For a folder without a compiled scene, files that were changed, a texture without a full
        model, and full models that have changed since.
    """
    place = Path(folder) / FILE
    stated = _stated(place)
    models: dict[str, Layered] = {}
    for texture, hashes in stated.items():
        file = Path(folder) / f"{file_stem(texture)}.json"
        model = load_model(file)
        if not isinstance(model, Layered) or model.sha256 != hashes["model_sha256"]:
            raise InputError(
                f"expected {file} as tactileq scene wrote it, got something else; compile the "
                "scene again."
            )
        models[texture] = model
        if full is not None:
            _check_full(texture, hashes["full_sha256"], full=full, folder=Path(folder))
    return models


def _check_full(
    texture: str, sha256: str, *, full: Mapping[str, TextureModel], folder: Path
) -> None:
    if texture not in full:
        raise InputError(
            f"expected a full model of {texture}, which is in the scene of {folder}, got none; "
            "give the folder of models that the scene was compiled from."
        )
    if full[texture].sha256 != sha256:
        raise InputError(
            f"expected the model of {texture} that the scene of {folder} was compiled from, got "
            "one that has changed since; compile the scene again."
        )


def _stated(place: Path) -> dict[str, dict[str, str]]:
    """What scene.json says of each texture's hashes."""
    values = read_json_object(place, what="a compiled scene", advice="compile the scene again")
    texts = ("texture", "full_sha256", "model_sha256")
    content = {name: value for name, value in values.items() if name != "sha256"}
    if (values.get("format"), values.get("version")) != (FORMAT, VERSION):
        raise InputError(
            f"expected the format {FORMAT}, version {VERSION}, in {place}, got "
            f"{shown(values.get('format'))}, version {shown(values.get('version'))}; give a folder "
            "that tactileq scene wrote."
        )
    if values.get("sha256") != sha256_of_values(content):
        raise InputError(
            f"expected {place} as tactileq scene wrote it, got something else; compile the scene "
            "again."
        )
    found = {}
    for entry in values["textures"]:
        found[entry["texture"]] = {name: entry[name] for name in texts}
    return found
