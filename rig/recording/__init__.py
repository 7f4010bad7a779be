"""How recordings come about: by hand with an accelerometer, or from other equipment's files."""
