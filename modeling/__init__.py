"""Texture models: from recordings to parameters, to fewer parameters, to vibration."""

from modeling import similarity
from modeling.autoregressive import ARFilter, ARModel, fit_ar
from modeling.errors import GridError, InputError
from modeling.estimators import ESTIMATORS, find_layers
from modeling.fitting import fit_texture, missing_conditions
from modeling.identification import identify_vibrator
from modeling.layers import Layers
from modeling.limits import Limits
from modeling.model import TextureModel
from modeling.peq import PEQ
from modeling.recording import Recording, RecordingSet
from modeling.regressed import RegressedModel
from modeling.renderer import Renderer
from modeling.simplification import CRITERIA, LayerVerdict, Simplification, simplify
from modeling.spectra import Spectrum, spectrum
from modeling.thresholds import Threshold
from modeling.vibrator import Compensation, Vibrator, compensation_for, flat_band

__all__ = [
    "CRITERIA",
    "ESTIMATORS",
    "PEQ",
    "ARFilter",
    "ARModel",
    "Compensation",
    "GridError",
    "InputError",
    "LayerVerdict",
    "Layers",
    "Limits",
    "Recording",
    "RecordingSet",
    "RegressedModel",
    "Renderer",
    "Simplification",
    "Spectrum",
    "TextureModel",
    "Threshold",
    "Vibrator",
    "compensation_for",
    "find_layers",
    "fit_ar",
    "fit_texture",
    "flat_band",
    "identify_vibrator",
    "missing_conditions",
    "similarity",
    "simplify",
    "spectrum",
]
