"""Whether a result can be believed, and what it means for the cell."""
