"""z-touch: a surface that switches an input."""
