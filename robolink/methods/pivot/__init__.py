"""pivot: one pin touched in tilted orientations, on five axes and six."""
