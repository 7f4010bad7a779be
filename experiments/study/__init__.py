"""The study file, its models and the balanced design."""
