"""Simulated studies, from answers to verdicts."""
