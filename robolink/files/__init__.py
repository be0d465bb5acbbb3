"""Files that people name, files that people write, and robolink's own files."""
