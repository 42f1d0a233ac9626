"""Time, accuracy and instructions of steps, ours and those of other engines."""
