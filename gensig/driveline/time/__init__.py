"""Drive lines in time: meshes that part, integrated by Newmark's method."""
