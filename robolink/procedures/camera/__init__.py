"""Marks brought before a camera, looked at, and what the looks say of the camera itself."""
