"""Ratings on scales."""
