"""Vision Guide in a simulated controller: sequences, calibrations, pictures of the world."""
