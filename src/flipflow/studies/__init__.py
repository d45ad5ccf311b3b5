"""One engineer's question a file; a function of the public face each."""
