"""What every result shares: how it is written and read again."""
