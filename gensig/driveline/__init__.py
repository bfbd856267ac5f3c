"""Drive lines from tables: shafts, gears and meshes, turned by an engine or a motor."""
