"""Files that people name, files that people write, and files of robolink's own."""
