"""Signal processing on plain arrays.

Indicators, synchronous averages, spectra. No physics, no files.
"""
