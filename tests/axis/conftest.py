"""The command line, as in the tests of the verbs."""

from __future__ import annotations

from tests.cli.conftest import run as run
