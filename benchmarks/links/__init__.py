"""What crosses a link, a process or a disk."""
