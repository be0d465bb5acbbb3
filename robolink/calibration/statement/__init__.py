"""What a result states of itself, what a turn test says about it, and both in words."""
