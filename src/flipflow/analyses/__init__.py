"""One engineer's question per file; a function of the public face each."""
