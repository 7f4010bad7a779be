"""An accelerometer on a sound card; strokes cut into conditions."""
