"""Commands about this computer: cell files, ports, addresses, completion, doctor."""
