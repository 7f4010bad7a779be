"""Estimates beside the planted truth."""
