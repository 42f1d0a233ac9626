"""Derived functions of a model."""
