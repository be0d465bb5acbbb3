"""The command line of robolink."""
