"""Steps of the rendering commands: stimulus sets, vibrators, exports and the render bench."""
