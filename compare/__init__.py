"""One finger, many solvers: measurements or truth, metrics, pictures, report."""
