"""Planted textures, surfaces drawn from statistics, random spectra, vibrators."""
