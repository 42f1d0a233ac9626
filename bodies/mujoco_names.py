"""Names of MuJoCo's shapes, and names of a file as C and Python can have them."""

import re

NAMES = ("plane", "height field", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")


def clean(name: str) -> str:
    """A name that C and Python can have."""
    word = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "part"
    return f"n{word}" if word[0].isdigit() else word
