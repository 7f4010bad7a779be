"""What is saved and rendered: layered, regressed and autoregressive models over a grid, and their
parameter table.
"""
