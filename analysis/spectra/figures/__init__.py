"""Pictures of spectra, layers, stimuli and vibrators."""
