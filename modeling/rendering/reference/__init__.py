"""The same operations in Python, bit for bit."""
