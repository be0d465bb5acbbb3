"""What comes with robolink to read and copy: pages and recipes."""
