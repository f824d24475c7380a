"""Recordings of one axis, of one spot and of distances: what they hold, in which units, and what sensor read them."""
