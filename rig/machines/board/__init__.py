"""The board below every machine with firmware: its program, its wire, its emulators."""
