"""Poses in programs of robots, a grammar for each maker."""
