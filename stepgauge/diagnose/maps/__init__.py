"""The diagnosis of probe maps, part by part; :func:`stepgauge.diagnose.probe_map.diagnose_probe_map` runs them all."""
