"""The step gauge: its certified positions, and how it lies in the machine."""
