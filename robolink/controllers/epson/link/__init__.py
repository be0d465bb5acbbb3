"""One login on an EPSON controller, and what is said over it."""
