"""Commands that compare methods, and demos."""
