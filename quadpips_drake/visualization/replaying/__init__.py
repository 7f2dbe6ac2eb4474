"""Values of a trial as Rerun shows them, on one time line."""
