"""A device that renders by itself: firmware in C99, emulators, and what a host asks of it.

docs/device.md
"""
