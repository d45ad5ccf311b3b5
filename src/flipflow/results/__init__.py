"""Frozen results and their data documents."""
