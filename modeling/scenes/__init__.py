"""A scene and the compiler that finds the least models for it."""
