"""The names of the dialects, and the ports on which they are usually spoken; loads nothing else."""

DEFAULT_DIALECT = "iiwa"
DEFAULT_PORTS = {
    "iiwa": 30000,
    "krc4": 54600,  # EKI's
}
