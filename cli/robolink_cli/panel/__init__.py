"""The panel: pages for a tablet at the cell."""
