"""Poses, rotations, least squares and statistics: the basis of every solver."""
