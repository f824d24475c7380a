"""The verbs of ``import stepgauge``: each takes files or objects, and returns a result that shows itself."""
