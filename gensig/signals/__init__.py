"""Signal processing on plain arrays: indicators, synchronous averages, spectra. No physics, no files."""
