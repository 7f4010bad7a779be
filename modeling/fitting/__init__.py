"""A whole texture: spectra of its conditions, search for layers, one field over all conditions,
rivals.
"""
