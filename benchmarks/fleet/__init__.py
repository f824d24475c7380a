"""The proof of the fleet's inference: a generator of its own, a scorer, and the command that runs both."""
