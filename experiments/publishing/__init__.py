"""Copies of data that identify nobody, what describes an archive; what was presented, rendered
again.
"""
