"""Small, honest fault classification on gensig data sets."""
