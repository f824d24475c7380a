"""An evaluation as a report to print and sign: what it says (content), and how it looks (templates)."""
