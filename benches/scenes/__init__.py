"""The shipped scenes compiled; compiled textures along strokes."""
