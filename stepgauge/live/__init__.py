"""Measuring over I++ DME: the protocol, the virtual CMM as a server, and the client that runs a program."""
