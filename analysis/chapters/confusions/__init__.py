"""Which textures were taken for which."""
