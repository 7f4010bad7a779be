"""Data for pictures of spectra; findings of one texture."""
