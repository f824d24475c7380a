"""What controllers and people wrote down, read back as recordings: logs, tables of any make, records of an axis."""
