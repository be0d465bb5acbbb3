"""The panel: pages for a tablet at the cell. One process serves them, one more does each job."""
