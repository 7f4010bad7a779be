"""Simulated studies, from answers to verdicts: what `tactileq power` counts."""
