"""Models that come with the package: one function ``model()`` in each module."""
