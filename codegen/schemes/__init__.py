"""Time-stepping schemes as programs over derived functions; no line of C."""
