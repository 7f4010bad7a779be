"""The firmware's shell in C99, its wire, simulated boards, emulators: below every machine with
firmware.
"""
