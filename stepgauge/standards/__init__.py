"""What standards ask for: uncertainty of measurement (GUM)."""
