"""Statements of SPEL+: motion, tools, points, settings and waits."""
