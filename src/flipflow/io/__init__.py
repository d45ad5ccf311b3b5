"""Files in and out: machine files, and the units people write in them."""
