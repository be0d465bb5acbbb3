"""Cells in which the production program measures, and calls robolink back for a verdict."""
