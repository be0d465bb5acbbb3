"""What touches of a pin show, besides the tip."""
