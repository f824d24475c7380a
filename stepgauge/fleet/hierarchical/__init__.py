"""Many machines, many gauges, many years: one inference."""
