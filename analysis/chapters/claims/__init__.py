"""Verdicts, and the sentence that answers the question of the report."""
