"""The window for visitors."""
