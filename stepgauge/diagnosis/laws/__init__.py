"""The vocabulary's effects as candidates: their signatures in a recording, their choices and shapes, their priors."""
