"""Drive lines of spur gears in the two-evaluation core, several records side by side."""
