"""Cells: a robot, its start pose and tool, and what stands round it, as a cell.toml describes them."""
