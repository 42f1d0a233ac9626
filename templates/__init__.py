"""Jinja templates that arrange generated expressions; they contain no algorithm."""
