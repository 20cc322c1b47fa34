# For the kernel of compliance.
cdef class Shift:
    cdef double _tick_s
    cdef object _feel
    cdef Py_ssize_t _substeps
    cdef double _stiffness
    cdef double[::1] _alone
    cdef double[::1] _in_contact
    cdef readonly object touch         # what surfaces do to the TCP where it is
    cdef readonly bint touches
    cdef double[::1] _acting           # the same: force (N), torque (Nm)
    cdef double[::1] _place            # scratch: (m),
    cdef double[::1] _velocity         # and m/s
    cdef double[::1] torque            # that surfaces have made in the last tick on average (Nm)
    cdef void start(self, object position) except *
    cdef bint meets(self, double[::1] position, double[::1] moved) except? -1
    cdef bint step(
        self, double stiffness, double[::1] x, double[::1] v, double[::1] force, double[::1] was,
        double[::1] moved
    ) except? -1
    cdef void _touch(self, object place, object velocity, double dt_s) except *
    cdef void _step_in_contact(
        self, double[::1] x, double[::1] v, double[::1] force, double[::1] was, double[::1] moved
    ) except *
