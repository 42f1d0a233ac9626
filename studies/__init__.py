"""Studies that ship with the package: short functions of the public interface."""
