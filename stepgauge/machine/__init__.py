"""The machine: its file, the virtual CMM, what stops it, and what it indicates."""
