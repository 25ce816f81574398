"""Report of one page and figures that compare runs."""
