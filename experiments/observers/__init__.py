"""Simulated participants, and what surfaces feel like to them."""
