"""One thread for linear algebra, set before numpy is loaded: the suite already has a process for each core."""

import os

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
