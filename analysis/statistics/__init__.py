"""What several chapters and planning use: tests, claims, verdicts, rates, mixed models."""
