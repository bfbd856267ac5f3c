"""The method with two evaluations of the mesh law a step; ``docs/theory/motion.md``."""
