"""A project: a folder with a file ``stepgauge.toml`` that states once what every verb would have to be given."""
