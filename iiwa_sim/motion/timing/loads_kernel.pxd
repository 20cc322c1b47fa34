# For rows where a load is too large.
from iiwa_sim.motion.timing.bounds_kernel cimport Rows

cdef double[:, :, ::1] room(Rows rows)
cdef void places(Rows rows, double[::1] c, Py_ssize_t k, double[:, ::1] at) noexcept
cdef void fill(Rows rows, Py_ssize_t k, Py_ssize_t i, Py_ssize_t order, double dd, double[:, ::1] at,
               double[:, :, ::1] found) noexcept
cdef double load_at(double[:, :, ::1] found, double[::1] parts, Py_ssize_t first, Py_ssize_t last, Py_ssize_t order,
                    Py_ssize_t i, Py_ssize_t p) noexcept
cdef double jerk_within(Rows rows, double[::1] c, Py_ssize_t k, Py_ssize_t i, Py_ssize_t o) noexcept
cdef double speed_within(Rows rows, double[::1] c, Py_ssize_t k, Py_ssize_t i, Py_ssize_t o) noexcept
