"""Remote Ethernet as a simulated EPSON controller serves it: login, requests, command window."""
