"""What can be exported as an equalizer: models with layers."""

from __future__ import annotations

from tactileq.modeling import ARModel, InputError
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.models.loading import Layered as Layered


def check_layered(model: AnyModel) -> Layered:
    """A model with layers; InputError for an autoregressive one."""
    if isinstance(model, ARModel):
        raise InputError(
            f"expected a model with layers, got the autoregressive one of {model.texture}; export "
            "a texture model, or this one as WAV."
        )
    return model
