"""What happens at a contact."""

from typing import NamedTuple


class Event(NamedTuple):
    """A change of a contact's state in a step.

    Attributes
    ----------
    t : float
        End of the step [s]; of a located step the time of the event itself.
    contact : str
        Name of the contact or friction element.
    kind : str
        ``"impact"``: it closed while its gap was shrinking; ``"close"``: it closed otherwise;
        ``"open"``, ``"stick"``, ``"slip"``, ``"reverse"`` (of one slip component);
        ``"guard"``: its guard took it away.
    P_N, P_F : float, tuple of float
        Percussions of the step [N s]; of a located step those of the impact alone, else 0.
    energy : float
        Change of the energy in the step of an impact [J]; 0 for other kinds.
    """

    t: float
    contact: str
    kind: str
    P_N: float
    P_F: tuple[float, ...]
    energy: float
