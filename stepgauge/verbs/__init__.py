"""The verbs, each a function with its definition: what ``import stepgauge`` gives and ``stepgauge VERB`` runs.

Modules of verbs import at the top what defines them and nothing that works, so that ``--help`` waits for nothing.
"""
