"""Programs and functions as C text: the only room that knows C."""
