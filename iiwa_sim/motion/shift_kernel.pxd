# For the kernel of compliance.
from iiwa_sim.robot.feeling_kernel cimport Feeling

cdef class Shift:
    cdef double _tick_s
    cdef bint _feels                   # whether there is anything to touch
    cdef Feeling _feeling
    cdef Py_ssize_t _substeps
    cdef double _stiffness
    cdef double[::1] _alone
    cdef double[::1] _in_contact
    cdef readonly bint touches         # whether surfaces do anything to the TCP where it is
    cdef double[::1] acting            # what they do: force (N), torque (Nm)
    cdef double[::1] _seen             # what they would do elsewhere
    cdef double[::1] _place            # scratch: (m),
    cdef double[::1] _velocity         # and m/s
    cdef double[::1] torque            # that surfaces have made in the last tick on average (Nm)
    cdef void start(self, double[::1] at) except *
    cdef bint meets(self, double[::1] at, double[::1] moved) except? -1
    cdef bint step(
        self, double stiffness, double[::1] x, double[::1] v, double[::1] force, double[::1] was,
        double[::1] moved
    ) except? -1
    cdef void _step_in_contact(
        self, double[::1] x, double[::1] v, double[::1] force, double[::1] was, double[::1] moved
    ) except *
