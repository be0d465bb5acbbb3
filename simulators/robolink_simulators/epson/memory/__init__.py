"""The memory of a simulated EPSON controller: tools, points, bits, variables, flash."""
