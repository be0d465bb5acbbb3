"""The panel: a page on a tablet at the cell. One process serves it, one more does each job."""
