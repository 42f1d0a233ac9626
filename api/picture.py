"""A picture of a run: superimposed poses of what a model draws, or curves over time."""

from pathlib import Path

from signorini.runtime.files import write_whole
from signorini.runtime.trajectory import Trajectory


def draw(traj: Trajectory, path: Path, count: int = 8) -> None:
    """Write a figure: `count` poses equally spaced in time, dark at the end.

    Models that draw nothing get curves over time.
    """
    from signorini.view.ink import poses
    from signorini.view.motion import motion

    if not traj.stepper.manifest["shapes"]:
        traj.plot(path)
        return
    frames = motion(traj)
    write_whole(path, lambda file: poses(frames, file, count))
