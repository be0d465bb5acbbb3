"""OPC UA: nodes of a server, read and written whole, and the PLC mailbox in four of them."""
