"""Commands that compare methods; demos."""
