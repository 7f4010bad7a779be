"""What simplification decided: a verdict on every layer, and the basis of the decision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.described_json import DescribedJson
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.places import matching
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.reprs import one_line

CriterionName = Literal["energy", "paper-fft", "paper-gain"]
CRITERIA: tuple[CriterionName, ...] = ("energy", "paper-fft", "paper-gain")
ENDING = "_simplification.json"
_ADVICE = "simplify the model again"


@dataclass(frozen=True)
class LayerVerdict(FileSection):
    """The verdict on one layer, and its reason.

    The worst condition is the one in which what decides stands highest against the threshold.
    `distance_db` there is, by `energy`, that of the change of power by dropping the layer, with
    what fills its shape, and, if it goes only with others, with the fewest of them; in files of
    earlier versions of its own power. By the paper's criteria it is that of its amplitude.

    `flip_probability` is how often that distance would be on the other side of the all-conditions
    rule if the levels scattered once more by their standard deviations, as in a block bootstrap of
    the records (normal, independent between conditions). Not in it: whether the estimator would
    find the layer again, its bias, the other rules.
    """

    WHERE = "layers"
    ADVICE = _ADVICE

    layer: Annotated[int, key("from 1, in the order of the full model", ge=1)]
    verdict: Annotated[Literal["kept", "dropped"], key("whether the simplified model has it")]
    reason: Annotated[str, key("one phrase")]
    worst_speed_mm_s: Annotated[float, key("of the worst condition", unit="mm/s")]
    worst_force_n: Annotated[float, key("of the worst condition", unit="N")]
    worst_frequency_hz: Annotated[float, key("of the layer there", unit="Hz")]
    distance_db: Annotated[
        float, key("to the threshold there; NaN where none is known", unit="dB", finite=False)
    ]
    flip_probability: Annotated[
        float, key("P(flip); NaN where a threshold is not known", finite=False)
    ]
    assumed: Annotated[
        int,
        key(
            "in how many conditions the threshold was not known at the layer's frequency (by "
            "`energy`: at most of the change), but its last level was held as a lower bound",
            ge=0,
        ),
    ]
    fills: Annotated[
        int,
        key(
            "the layer (from 1) whose shape this one only fills, with which alone it goes; 0 for "
            "a peak of its own",
            ge=0,
        ),
    ]


@dataclass(frozen=True, eq=False, kw_only=True)
class Simplification(DescribedJson):
    """A simplified model and the verdict on every layer of the full one.

    What follows from the rest is not given: it is there to be read in the file.
    """

    WHAT = "a simplification"
    FORMAT = "tactileq.simplification"
    ADVICE = _ADVICE

    texture: Annotated[str, key("of the model")] = ""
    simulated: Annotated[bool, key("as the model says")] = False
    identical: Annotated[
        bool,
        key("whether the simplified model is the full one, so that there is nothing to compare"),
    ] = False
    criterion: Annotated[CriterionName, key("by which layers were kept or dropped")]
    margin_db: Annotated[float, key("below the threshold", unit="dB", ge=0, as_given=True)]
    hold_above: Annotated[
        bool,
        key("whether the threshold's last level was held as a lower bound above its table"),
    ]
    full_sha256: Annotated[str, key("of the full model (`TextureModel.sha256`)")]
    model_sha256: Annotated[str, key("of the simplified one")] = ""
    threshold_sha256: Annotated[str, key("of its values")] = ""
    threshold: Threshold
    layers: Annotated[tuple[LayerVerdict, ...], key("one per layer of the full model, in order")]
    model: Annotated[TextureModel, key("simplified")]
    sha256: Annotated[str, key("of all the rest")] = ""

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        following = {
            "texture": self.model.texture,
            "simulated": self.model.simulated,
            "identical": self.model.sha256 == self.full_sha256,
            "model_sha256": self.model.sha256,
            "threshold_sha256": self.threshold.sha256,
        }
        for name, value in following.items():
            object.__setattr__(self, name, value)
        rest = {name: value for name, value in self.to_dict().items() if name != "sha256"}
        object.__setattr__(self, "sha256", sha256_of_values(rest))

    @classmethod
    def read(cls, values: object, *, where: str = "", folder: Path | None = None) -> Self:
        """As of any file; what was changed is refused: all has the SHA-256 that is stated."""
        made = super().read(values, where=where, folder=folder)
        assert isinstance(values, Mapping)  # or it would have been refused
        again = made.to_dict()
        changed = [name for name in again if again[name] != values[name]]
        changed = [name for name in changed if name != "sha256"] or changed
        if changed:
            raise InputError(
                f"expected {', '.join(changed)} as tactileq simplify wrote it, got something else; "
                f"the file was changed, {_ADVICE}."
            )
        return made

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Simplification):
            return NotImplemented
        return self.to_dict() == other.to_dict()

    __hash__ = None  # type: ignore[assignment]


def load_simplifications(folder: Path) -> dict[str, Simplification]:
    """All simplifications of a folder by the name of their texture.

    Raises
    ------
    InputError
        For a folder without any, a file that is none, and two of one texture.
    """
    found: dict[str, Simplification] = {}
    for path in matching(folder, f"*{ENDING}"):
        loaded = Simplification.load(path)
        if loaded.model.texture in found:
            raise InputError(
                f"expected one simplification of each texture in {folder}, got two of "
                f"{loaded.model.texture!r}; move {path.name} or the other one away."
            )
        found[loaded.model.texture] = loaded
    if not found:
        raise InputError(
            f"expected files TEXTURE{ENDING} in {folder}, got none; simplify the models with "
            "tactileq simplify."
        )
    return found
