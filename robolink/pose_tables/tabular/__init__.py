"""Tables of poses: which column is what, in lines or in objects."""
