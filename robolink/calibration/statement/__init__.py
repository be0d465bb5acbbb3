"""What a result states, what a turn test shows about it, and both in words."""
