"""What people look at: motions as pages and films, plots over time."""
