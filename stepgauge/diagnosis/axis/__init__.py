"""Recordings without gauge and machine, diagnosed as those of a gauge are, and told in their own units and words."""
