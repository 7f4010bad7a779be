"""A device that renders by itself: its firmware in C99, emulators of it, and what a host asks of it.

docs/device.md
"""
