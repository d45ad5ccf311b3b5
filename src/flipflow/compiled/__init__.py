"""What every kernel needs: the decorator that compiles it, dense algebra, what it can report."""
