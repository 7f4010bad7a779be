"""From one spectrum to layers: likelihood, peaks, the coherent response, `joint`, the paper's
recipe.
"""
