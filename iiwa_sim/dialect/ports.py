"""The names of the dialects, and the ports on which they are usually spoken; loads nothing else."""

IIWA = "iiwa"
KRC4 = "krc4"
DEFAULT_DIALECT = IIWA
DEFAULT_PORTS = {
    IIWA: 30000,
    KRC4: 54600,  # EKI's
}
