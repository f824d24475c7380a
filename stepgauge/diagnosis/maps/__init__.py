"""The diagnosis of probe maps, part by part; :func:`stepgauge.diagnosis.probe_map.diagnose_probe_map` runs them all."""
