"""Branches of periodic motions, followed over frequency or a field, and their special points."""
