"""Output and input at a console: what leaves, in which form, and with which exit code."""
