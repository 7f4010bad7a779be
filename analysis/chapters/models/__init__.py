"""What was dropped, and how similar spectra remain."""
