"""Figures for print: one style, no global state, every format a report may need."""
