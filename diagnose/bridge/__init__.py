"""The bridge to a measured machine: a frozen protocol, with comparators beside every score."""
