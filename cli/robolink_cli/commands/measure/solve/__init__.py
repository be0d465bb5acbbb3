"""solve: calculate a tool offset from a file. Nothing is connected, nothing moves."""
