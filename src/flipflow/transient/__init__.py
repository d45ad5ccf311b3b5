"""Motion in time: simulation, sweeps, varying speed, start and stop."""
