"""Poses, rotations, least squares and statistics: what every solver stands on."""
