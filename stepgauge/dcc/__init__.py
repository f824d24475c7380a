"""Digital Calibration Certificates: DCC XML 3.2.0 of PTB with D-SI quantities, written, read and checked."""
