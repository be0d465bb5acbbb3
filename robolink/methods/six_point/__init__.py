"""six-point: position and orientation of a tool, on five axes and six."""
