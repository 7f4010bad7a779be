"""Machines with a servo or firmware of their own."""
