"""Surfaces with known truth, and the stimulus sets rendered from models."""

from tactileq import modeling

if not hasattr(modeling, "HOMES"):  # modeling.py beside a script that is run
    raise ImportError(
        f"expected the package modeling of tactileq, got {modeling}; rename that, or run python -P."
    )
