"""beams: two crossed light beams."""
