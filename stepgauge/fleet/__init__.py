"""Many machines, many gauges, many years: their recordings in one store, and what follows from all of them."""
