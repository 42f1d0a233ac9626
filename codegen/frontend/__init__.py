"""What a user writes, checked and translated into CasADi SX."""
