"""The local page: a thin view over the public functions and over the files of a project (``docs/web.md``).

What it shows is a file that the command line wrote or could write; the server keeps nothing that would be lost with it.
"""
