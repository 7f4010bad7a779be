"""Findings of the paper beside ours."""
