"""What a simulated EPSON controller remembers: tools, points, bits, variables, flash."""
