"""Places where model functions are evaluated."""

import numpy as np
import signorini as sg


def draw(stepper: sg.Stepper, seed: int) -> dict[str, np.ndarray | float]:
    """A state near the initial one, with inputs and percussions."""
    rng = np.random.default_rng(seed)
    t, q, v = stepper.initial_state()
    n = stepper.sizes
    return {
        "t": t + rng.uniform(0.1, 1),
        "q": q + rng.normal(size=n["n_q"]) * 0.3,
        "v": v + rng.normal(size=n["n_q"]),
        "u": rng.normal(size=n["n_u"]),
        "R": rng.normal(size=n["n_R"]),
    }
