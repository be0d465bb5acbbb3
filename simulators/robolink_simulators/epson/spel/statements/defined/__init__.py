"""Statements about what a robot is told once and keeps."""
