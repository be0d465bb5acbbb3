"""Poses, movements, and what sees or switches at the tip."""
