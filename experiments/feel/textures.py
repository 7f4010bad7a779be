"""The textures that can be felt, each with its full and perhaps its simplified model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import Layered, load_model, models_in


@dataclass(frozen=True, kw_only=True, eq=False)
class Texture:
    """A texture to feel.

    Parameters
    ----------
    full : TextureModel or RegressedModel
        In g.
    simplified : TextureModel or RegressedModel, optional
        Of the same texture and rate, in g.

    Raises
    ------
    InputError
        For a model in arbitrary units, or two models of different rates.
    """

    full: Layered
    simplified: Layered | None = None

    def __post_init__(self) -> None:
        for model in (self.full, self.simplified):
            if model is not None and model.unit != "g":
                raise InputError(
                    f"{self.name}: expected a model in g, got the unit {shown(model.unit)}; "
                    "calibrate the recordings (g per full scale) and fit it again."
                )
        if self.simplified is not None and self.simplified.rate_hz != self.full.rate_hz:
            raise InputError(
                f"{self.name}: expected a full and a simplified model of one rate, got "
                f"{self.full.rate_hz:g} and {self.simplified.rate_hz:g} Hz; simplify the full "
                "model again."
            )

    @property
    def name(self) -> str:
        """Of the surface."""
        return self.full.texture

    def model(self, *, simplified: bool) -> Layered:
        """The simplified model if that is asked for and there is one, else the full one."""
        return self.simplified if simplified and self.simplified is not None else self.full


def load_textures(named: Sequence[Path], simplified: Path | None = None) -> tuple[Texture, ...]:
    """Textures from model files and folders of them, with the simplified models of a folder.

    Parameters
    ----------
    named : sequence of Path
        Full models, one for each texture.
    simplified : Path, optional
        Folder of simplified models; a texture that is not there has none.

    Raises
    ------
    InputError
        For a file that is no model of layers, two models of one texture, or a folder of simplified
        models that has none for any of the textures.
    """
    full = _by_texture(named, "model")
    fewer = {} if simplified is None else _by_texture([simplified], "simplified model")
    if simplified is not None and not set(full) & set(fewer):
        raise InputError(
            f"expected a simplified model of {' or '.join(full)} in {simplified}, got "
            f"{', '.join(fewer)}; simplify these models, too."
        )
    return tuple(Texture(full=model, simplified=fewer.get(name)) for name, model in full.items())


def _by_texture(named: Iterable[Path], what: str) -> dict[str, Layered]:
    found: dict[str, Layered] = {}
    for path in _files(named):
        model = _layered(path)
        if model.texture in found:
            raise InputError(
                f"expected one {what} of each texture, got two of {shown(model.texture)}; leave "
                f"{path} or the other one out."
            )
        found[model.texture] = model
    return found


def _files(named: Iterable[Path]) -> list[Path]:
    return [file for path in named for file in (models_in(path)[0] if path.is_dir() else [path])]


def _layered(path: Path) -> Layered:
    model = load_model(path)
    if isinstance(model, ARModel):
        raise InputError(
            f"expected a model of layers in {path}, got an autoregressive one, which has no layers "
            "to show and no real-time renderer; fit it by tactileq model."
        )
    return model
