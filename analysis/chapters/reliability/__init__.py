"""Agreement, repeats and careless answers."""
