# For kernels that look whether the robot stays in a zone: `distance_of`.
from iiwa_sim.motion.path.piecewise_kernel cimport Polynomial

cdef class Zone:
    cdef readonly double radius
    cdef readonly bint of_tcp
    cdef double[::1] _centre
    cdef double[:, ::1] _fixed
    cdef double distance_of(self, double[:, ::1] joints, Py_ssize_t row) noexcept
    cdef double _beyond(self, Polynomial path, bint at_end, double part, double[:, :, ::1] room) noexcept
