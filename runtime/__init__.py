"""Compiled stepper -> trajectory: compile, load, step, record.

Needs NumPy and a C compiler only.
"""
