"""The laws that are stated, fitted together with all their shapes: values, uncertainties, and what they may hide."""
