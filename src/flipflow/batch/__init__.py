"""Many motions at once, on threads."""
