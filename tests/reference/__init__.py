"""Independent routes to the motions of a machine with clearances: no kernel of flipflow is used."""
