"""From a recording and a certificate to the errors of the machine."""
