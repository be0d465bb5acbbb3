"""Commands that serve simulated controllers, and the demonstration."""
