"""Texture models: from recordings to parameters, to fewer parameters, to vibration.

Each name is loaded on first use, so that `import tactileq.modeling.errors` loads no numerics.
"""

from typing import TYPE_CHECKING

from tactileq.modeling.face import lazily

HOMES = {
    "errors": "GridError InputError",
    "recordings.recording": "Recording",
    "recordings.recording_set": "RecordingSet",
    "recordings.spectrum": "Spectrum spectrum",
    "equalizer.peq": "PEQ",
    "models.texture_model": "TextureModel",
    "models.regressed_model": "RegressedModel",
    "models.ar_model": "ARFilter ARModel",
    "estimation.layers": "ESTIMATORS Layers",
    "estimation.estimators": "find_layers",
    "fitting.texture": "fit_texture missing_conditions",
    "fitting.autoregressive": "fit_ar",
    "regression.driving": "regressed",
    "perception.thresholds": "Threshold",
    "perception.simplification": "simplify",
    "perception.verdicts": "CRITERIA LayerVerdict Simplification",
    "vibrators.vibrator": "Vibrator",
    "vibrators.compensation": "Compensation compensation_for flat_band",
    "vibrators.identification": "identify_vibrator",
    "rendering.limits": "Limits",
    "rendering.many": "render_many",
    "rendering.renderer": "Renderer",
    "scenes.scene": "Scene",
    "scenes.compiled": "CompiledScene",
    "scenes.compiler": "compile_scene",
    "similarity": "",
}

if TYPE_CHECKING:
    from tactileq.modeling import similarity as similarity
    from tactileq.modeling.equalizer.peq import PEQ as PEQ
    from tactileq.modeling.errors import GridError as GridError
    from tactileq.modeling.errors import InputError as InputError
    from tactileq.modeling.estimation.estimators import find_layers as find_layers
    from tactileq.modeling.estimation.layers import ESTIMATORS as ESTIMATORS
    from tactileq.modeling.estimation.layers import Layers as Layers
    from tactileq.modeling.fitting.autoregressive import fit_ar as fit_ar
    from tactileq.modeling.fitting.texture import fit_texture as fit_texture
    from tactileq.modeling.fitting.texture import missing_conditions as missing_conditions
    from tactileq.modeling.models.ar_model import ARFilter as ARFilter
    from tactileq.modeling.models.ar_model import ARModel as ARModel
    from tactileq.modeling.models.regressed_model import RegressedModel as RegressedModel
    from tactileq.modeling.models.texture_model import TextureModel as TextureModel
    from tactileq.modeling.perception.simplification import simplify as simplify
    from tactileq.modeling.perception.thresholds import Threshold as Threshold
    from tactileq.modeling.perception.verdicts import CRITERIA as CRITERIA
    from tactileq.modeling.perception.verdicts import LayerVerdict as LayerVerdict
    from tactileq.modeling.perception.verdicts import Simplification as Simplification
    from tactileq.modeling.recordings.recording import Recording as Recording
    from tactileq.modeling.recordings.recording_set import RecordingSet as RecordingSet
    from tactileq.modeling.recordings.spectrum import Spectrum as Spectrum
    from tactileq.modeling.recordings.spectrum import spectrum as spectrum
    from tactileq.modeling.regression.driving import regressed as regressed
    from tactileq.modeling.rendering.limits import Limits as Limits
    from tactileq.modeling.rendering.many import render_many as render_many
    from tactileq.modeling.rendering.renderer import Renderer as Renderer
    from tactileq.modeling.scenes.compiled import CompiledScene as CompiledScene
    from tactileq.modeling.scenes.compiler import compile_scene as compile_scene
    from tactileq.modeling.scenes.scene import Scene as Scene
    from tactileq.modeling.vibrators.compensation import Compensation as Compensation
    from tactileq.modeling.vibrators.compensation import compensation_for as compensation_for
    from tactileq.modeling.vibrators.compensation import flat_band as flat_band
    from tactileq.modeling.vibrators.identification import identify_vibrator as identify_vibrator
    from tactileq.modeling.vibrators.vibrator import Vibrator as Vibrator
else:  # a type checker that saw __getattr__ would take every name for public
    __getattr__, __dir__, __all__ = lazily(__name__, HOMES)
