"""Proof that generated C is the model: an independent reference, drawn states, a report."""
