"""Options of the simulator: one model for command line, environment, fleet file, fixture and `Simulator`."""
