"""The one way to read and write a file; locks, places, hashes, provenance; files declared once; the
tables of answers, claims and plan.
"""
