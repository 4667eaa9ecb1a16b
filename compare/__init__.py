"""Compare the solvers: metrics, pictures, report and the command line."""
