"""What is computed: solvers, simulators, whole procedures."""
