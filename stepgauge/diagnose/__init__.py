"""When simulation and recording disagree: where, by which physics, and the proof.

noise -> locate -> propose -> select -> prove. :func:`stepgauge.diagnose.engine.diagnose` runs them all.
"""
