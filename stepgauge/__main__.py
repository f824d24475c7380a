"""``python -m stepgauge`` is the ``stepgauge`` command."""

from stepgauge.cli import main

if __name__ == "__main__":
    main()
