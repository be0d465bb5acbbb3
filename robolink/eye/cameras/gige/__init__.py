"""GigE Vision cameras, through the library Aravis."""
