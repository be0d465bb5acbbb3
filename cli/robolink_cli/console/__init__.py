"""Output and input at a console: the form of the output, and the exit codes."""
