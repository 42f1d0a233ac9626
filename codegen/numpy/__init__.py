"""Model functions as a Python module that needs NumPy alone."""
