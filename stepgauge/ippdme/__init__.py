"""The language of I++ DME, the interface of CMM controllers: lines, values, errors. No sockets, no machine."""
