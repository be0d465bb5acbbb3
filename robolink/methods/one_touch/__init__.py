"""one-touch: a pin whose place is known, touched once."""
