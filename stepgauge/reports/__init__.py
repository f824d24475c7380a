"""An evaluation as a report to print and sign: its content, and its layout (templates)."""
