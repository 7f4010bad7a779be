"""Texture models: from recordings to parameters, to fewer parameters, to vibration.

Each name is loaded on first use, so that `import modeling.errors` loads no numerics.
"""

from typing import TYPE_CHECKING

from modeling.face import lazily

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
    from modeling import similarity as similarity
    from modeling.equalizer.peq import PEQ as PEQ
    from modeling.errors import GridError as GridError
    from modeling.errors import InputError as InputError
    from modeling.estimation.estimators import find_layers as find_layers
    from modeling.estimation.layers import ESTIMATORS as ESTIMATORS
    from modeling.estimation.layers import Layers as Layers
    from modeling.fitting.autoregressive import fit_ar as fit_ar
    from modeling.fitting.texture import fit_texture as fit_texture
    from modeling.fitting.texture import missing_conditions as missing_conditions
    from modeling.models.ar_model import ARFilter as ARFilter
    from modeling.models.ar_model import ARModel as ARModel
    from modeling.models.regressed_model import RegressedModel as RegressedModel
    from modeling.models.texture_model import TextureModel as TextureModel
    from modeling.perception.simplification import simplify as simplify
    from modeling.perception.thresholds import Threshold as Threshold
    from modeling.perception.verdicts import CRITERIA as CRITERIA
    from modeling.perception.verdicts import LayerVerdict as LayerVerdict
    from modeling.perception.verdicts import Simplification as Simplification
    from modeling.recordings.recording import Recording as Recording
    from modeling.recordings.recording_set import RecordingSet as RecordingSet
    from modeling.recordings.spectrum import Spectrum as Spectrum
    from modeling.recordings.spectrum import spectrum as spectrum
    from modeling.regression.driving import regressed as regressed
    from modeling.rendering.limits import Limits as Limits
    from modeling.rendering.many import render_many as render_many
    from modeling.rendering.renderer import Renderer as Renderer
    from modeling.scenes.compiled import CompiledScene as CompiledScene
    from modeling.scenes.compiler import compile_scene as compile_scene
    from modeling.scenes.scene import Scene as Scene
    from modeling.vibrators.compensation import Compensation as Compensation
    from modeling.vibrators.compensation import compensation_for as compensation_for
    from modeling.vibrators.compensation import flat_band as flat_band
    from modeling.vibrators.identification import identify_vibrator as identify_vibrator
    from modeling.vibrators.vibrator import Vibrator as Vibrator
else:  # a type checker that saw __getattr__ would take every name for public
    __getattr__, __dir__, __all__ = lazily(__name__, HOMES)
