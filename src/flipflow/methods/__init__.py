"""Methods: options, machines flattened into plans, solvers of periodic motions."""
