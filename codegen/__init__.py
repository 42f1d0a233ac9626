"""Symbolic model -> derived functions -> scheme residual and Jacobian -> C text."""
