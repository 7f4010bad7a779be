"""A vibrator and an accelerometer behind an audio server."""
