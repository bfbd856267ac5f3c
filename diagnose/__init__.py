"""Small, honest fault classification on gensig data sets."""

from gensig import moved

moved.install()
