"""Scenes that break time-steppers, run in great numbers and judged independently of the solver."""
