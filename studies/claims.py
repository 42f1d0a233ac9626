"""Claims beside measurements: what was said, what came out, and the verdict from the data."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """One claim and what was measured.

    Attributes
    ----------
    study, text : str
        Where the claim belongs, and its words.
    measured, limit : float
        The measured number and what it is held to.
    how : {"<=", ">="}
        The relation that makes the verdict.
    unit : str
        For people.
    """

    study: str
    text: str
    measured: float
    how: str
    limit: float
    unit: str = ""

    @property
    def met(self) -> bool:
        """The verdict; a number that is not finite never meets a claim."""
        return self.measured <= self.limit if self.how == "<=" else self.measured >= self.limit

    @property
    def numbers(self) -> str:
        """Measured number, relation and limit."""
        unit = f" {self.unit}" if self.unit else ""
        sign = {"<=": "≤", ">=": "≥"}[self.how]
        return f"{self.measured:.4g} {sign} {self.limit:.4g}{unit}"


def near(
    study: str, text: str, measured: float, expected: float, tolerance: float, unit: str = ""
) -> Claim:
    """The claim that a number is within a tolerance of the expected one."""
    words = f"{text} = {expected:.6g}{' ' + unit if unit else ''}, off by"
    return Claim(study, words, abs(measured - expected), "<=", tolerance, unit)


def markdown(claims: Iterable[Claim]) -> str:
    """The table for documentation."""
    lines = ["| study | claim | measured, limit | verdict |", "|---|---|---|---|"]
    for c in claims:
        text = c.text.replace("|", "\\|")
        lines.append(f"| {c.study} | {text} | {c.numbers} | {'met' if c.met else '**missed**'} |")
    return "\n".join(lines) + "\n"
