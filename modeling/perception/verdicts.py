"""What simplification decided: a verdict on every layer, and the basis of the decision."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal

from modeling.checks import check_choice, check_keys, check_number, is_number
from modeling.errors import InputError
from modeling.files.documents import dump_json, read_json_object
from modeling.files.hashes import sha256_of_values
from modeling.files.writing import write_text
from modeling.models.texture_model import TextureModel
from modeling.perception.thresholds import Threshold

CriterionName = Literal["energy", "paper-fft", "paper-gain"]
CRITERIA: tuple[CriterionName, ...] = ("energy", "paper-fft", "paper-gain")
FORMAT = "tactileq.simplification"
VERSION = 1
ENDING = "_simplification.json"


@dataclass(frozen=True)
class LayerVerdict:
    """The verdict on one layer, and its reason.

    Parameters
    ----------
    layer : int
        1-based, in the order of the full model.
    verdict : {"kept", "dropped"}
    reason : str
        One phrase.
    worst_speed_mm_s, worst_force_n, worst_frequency_hz : float
        The condition in which what decides stands highest against the threshold; the layer's
        frequency there.
    distance_db : float
        The distance to the threshold there, in dB; NaN where no threshold is known. By `energy` of
        the change of power by dropping the layer, with what fills its shape, and, if it goes only
        with others, with the fewest of them; in files of earlier versions of its own power. By the
        paper's criteria of its amplitude.
    flip_probability : float
        P(flip): how often that distance would be on the other side of the all-conditions rule if
        the levels scattered once more by their standard deviations, as in a block bootstrap of the
        records (normal, independent between conditions); NaN where a threshold is not known. Not
        in it: whether the estimator would find the layer again, its bias, the other rules.
    assumed : int
        In how many conditions the threshold was not known at the layer's frequency (by `energy`:
        at most of the change), but its last level was held as a lower bound.
    fills : int
        The layer (1-based) whose shape this one only fills, with which alone it goes; 0 for a peak
        of its own.
    """

    layer: int
    verdict: Literal["kept", "dropped"]
    reason: str
    worst_speed_mm_s: float
    worst_force_n: float
    worst_frequency_hz: float
    distance_db: float
    flip_probability: float
    assumed: int
    fills: int


@dataclass(frozen=True, eq=False)
class Simplification:
    """A simplified model and the verdict on every layer of the full one.

    Parameters
    ----------
    model : TextureModel
        Simplified.
    layers : tuple of LayerVerdict
        One per layer of the full model, in its order.
    criterion : {"energy", "paper-fft", "paper-gain"}
    threshold : Threshold
    margin_db : float
        ≥ 0.
    hold_above : bool
        Whether the threshold's last level was held as a lower bound above its table.
    full_sha256 : str
        Of the full model (`TextureModel.sha256`).
    """

    model: TextureModel
    layers: tuple[LayerVerdict, ...]
    criterion: CriterionName
    threshold: Threshold
    margin_db: float
    hold_above: bool
    full_sha256: str

    @property
    def identical(self) -> bool:
        """Whether the simplified model is the full one, so that there is nothing to compare."""
        return self.model.sha256 == self.full_sha256

    def save(self, path: str | Path) -> None:
        """Write all of it as versioned JSON; the file is there whole or not at all."""
        write_text(path, self.to_json())

    def to_json(self) -> str:
        """The text of its file."""
        return dump_json(self._values())

    @staticmethod
    def load(path: str | Path) -> Simplification:
        """Read what `save` wrote; it loads back equal.

        Raises
        ------
        InputError
            For a file that is missing, is no such file, or was changed: the models and the
            threshold in it must have the SHA-256 that it states.
        """
        source = Path(path)
        values = read_json_object(source, advice="simplify the model again")
        try:
            return _from_values(values, source)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
        except (TypeError, ValueError, AttributeError, OverflowError):
            raise InputError(
                f"expected the values of a {FORMAT} in {source}, got others; simplify the model "
                "again."
            ) from None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Simplification):
            return NotImplemented
        return self._values() == other._values()

    __hash__ = None  # type: ignore[assignment]

    def _values(self) -> dict[str, Any]:
        values = self._plain()
        return {**values, "sha256": sha256_of_values(values)}

    def _plain(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "version": VERSION,
            "texture": self.model.texture,
            "simulated": self.model.simulated,
            "identical": self.identical,
            "criterion": self.criterion,
            "margin_db": self.margin_db,
            "hold_above": self.hold_above,
            "full_sha256": self.full_sha256,
            "model_sha256": self.model.sha256,
            "threshold_sha256": self.threshold.sha256,
            "threshold": self.threshold.to_dict(),
            "layers": [_plain_verdict(verdict) for verdict in self.layers],
            "model": self.model.to_dict(),
        }


def load_simplifications(folder: Path) -> dict[str, Simplification]:
    """All simplifications of a folder by the name of their texture.

    Raises
    ------
    InputError
        For a folder without any, a file that is none, and two of one texture.
    """
    found: dict[str, Simplification] = {}
    for path in sorted(folder.glob(f"*{ENDING}")):
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


_NAMES = (
    *("format", "version", "texture", "simulated", "identical", "criterion", "margin_db"),
    *("hold_above", "full_sha256", "model_sha256", "threshold_sha256", "threshold", "layers"),
    *("model", "sha256"),
)
# JSON knows no number that is not finite.
_NUMBERS = ("distance_db", "flip_probability")


def _plain_verdict(verdict: LayerVerdict) -> dict[str, Any]:
    values = asdict(verdict)
    for name in _NUMBERS:
        values[name] = values[name] if math.isfinite(values[name]) else str(values[name])
    return values


def _from_values(values: Mapping[str, Any], source: Path) -> Simplification:
    """A simplification from the values of its file, each of them checked."""
    if (values.get("format"), values.get("version")) != (FORMAT, VERSION):
        raise InputError(
            f"expected the format {FORMAT}, version {VERSION}, got {values.get('format')!r}, "
            f"version {values.get('version')!r}; give a file that tactileq simplify wrote."
        )
    _check_all(values, _NAMES, where="the file")
    check_choice("criterion", values["criterion"], CRITERIA)
    check_number("margin_db", values["margin_db"], high=sys.float_info.max)
    threshold = Threshold(**values["threshold"])
    made = Simplification(
        TextureModel.from_dict(values["model"], source=source),
        tuple(_verdict(each) for each in values["layers"]),
        values["criterion"],
        threshold,
        values["margin_db"],
        values["hold_above"] is True,
        str(values["full_sha256"]),
    )
    again = made._values()
    changed = [name for name in _NAMES if again[name] != values[name]]
    changed = [name for name in changed if name != "sha256"] or changed
    if changed:
        raise InputError(
            f"expected {', '.join(changed)} as tactileq simplify wrote it, got something else; "
            "the file was changed, simplify the model again."
        )
    return made


def _verdict(values: Mapping[str, Any]) -> LayerVerdict:
    _check_all(values, tuple(field.name for field in fields(LayerVerdict)), where="a layer")
    numbers = {name: _number(values[name], name) for name in _NUMBERS}
    return LayerVerdict(**{**values, **numbers})


def _number(value: object, name: str) -> float:
    if isinstance(value, str) or is_number(value):
        return float(value)
    raise InputError(f"expected a number for {name}, got {value!r}; simplify the model again.")


def _check_all(values: Mapping[str, Any], names: tuple[str, ...], *, where: str) -> None:
    check_keys(values, names, where=where)
    if missing := [name for name in names if name not in values]:
        raise InputError(
            f"expected {', '.join(missing)} in {where}, got none; simplify the model again."
        )
