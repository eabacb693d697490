"""Figures of studies, maps and reports, for the screen and for print."""
