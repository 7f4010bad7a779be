"""Machines with firmware or a servo of their own, and the board below them."""
