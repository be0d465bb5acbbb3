"""What poses on one point show about themselves, beyond the offset that they give."""
