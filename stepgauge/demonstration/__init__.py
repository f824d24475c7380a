"""A fault concealed in the virtual machine, found from its recordings, and compared with what was concealed."""
