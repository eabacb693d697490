"""The application: dashboard, command line and reports; all numerics live in `vsep`."""
