"""Textures with known truth, stimulus sets and exports."""
