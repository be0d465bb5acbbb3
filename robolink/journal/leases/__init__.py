"""One at a time on a controller: leases, who holds them, how they look to others."""
