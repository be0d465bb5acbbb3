"""Commands for plans of many cells."""
