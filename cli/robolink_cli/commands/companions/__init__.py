"""Commands about the programs for the controllers themselves, and register maps."""
