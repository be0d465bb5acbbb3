"""What all methods are declared with: limits and units, what is checked, what several share."""
