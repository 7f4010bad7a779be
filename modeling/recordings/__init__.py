"""`Recording`, `RecordingSet`; hum, tones and drift; `Spectrum`."""
