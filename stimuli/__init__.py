"""Surfaces with known truth, and the stimulus sets rendered from models."""
