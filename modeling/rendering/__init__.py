"""`Renderer` and its kernel in C; plans, limits, noise, interpolation to the output's rate."""
