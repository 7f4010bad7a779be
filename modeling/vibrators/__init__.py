"""A vibrator's response, its identification and its compensation (eq. 7)."""
