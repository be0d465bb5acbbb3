"""What carries bytes to the machines of virtual cells, and bends them."""
