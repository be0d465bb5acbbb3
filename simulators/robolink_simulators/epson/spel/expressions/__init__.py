"""Expressions of SPEL+: values, operators, functions, and how they print."""
