"""The tools of an EPSON controller: read, written, preserved, settled."""
