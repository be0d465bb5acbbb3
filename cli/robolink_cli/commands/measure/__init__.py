"""Commands that measure or calculate where a tip is."""
