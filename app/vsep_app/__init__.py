"""The application: dashboard and report; all numerics live in `vsep`."""
