"""Time, accuracy and stability of rendering beside rivals."""
