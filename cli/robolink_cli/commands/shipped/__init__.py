"""What comes with robolink to be read and copied: pages and recipes."""
