"""Hosts that carry a simulated device: inside this process, or on a loopback TCP port."""
