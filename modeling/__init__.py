"""Pure numerics: no clock, no screen, no plot; `hand`, `seeds`, `checks`, `threads`, `engines` and
the public `face` lie beside its folders.

Each name is loaded on first use, so that `import tactileq.modeling.errors` loads no numerics.
"""

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

__getattr__, __dir__, __all__ = lazily(__name__, HOMES)
