"""Pure, vectorised physics of probes and surfaces: numbers in, numbers out, each function tied to its source."""
