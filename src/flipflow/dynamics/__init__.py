"""Between contacts the motion is linear: modes, exact flow, the search for the next contact."""
