"""Cells: a robot, its start pose, tool and surroundings, as a cell.toml describes them."""
