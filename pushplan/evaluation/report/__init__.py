"""Say what a run means: tables, figures, a page."""
