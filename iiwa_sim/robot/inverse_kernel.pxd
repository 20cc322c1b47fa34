# For kernels that call this as a C function.
cpdef int solve(
    int kind, double[::1] numbers, double[:, ::1] poses, Py_ssize_t row, double redundancy, int status,
    double[::1] seed, double aligned, double[:, ::1] joints
) noexcept

cdef class Inverse:
    cdef readonly object model
    cdef readonly int kind               # the closed form
    cdef readonly object numbers         # the dimensions of the arm for it
    cdef readonly object statuses
    cdef readonly object redundancy_range
    cdef double[::1] _numbers
    cdef object _form
    cdef object _redundant               # index of a joint, or None
    cdef Py_ssize_t _count               # of joints
    cdef double[::1] _lowest             # joint limits (rad)
    cdef double[::1] _highest
    cdef double[:, ::1] _pose            # scratch: a row of its own ...
    cdef double[:, ::1] _found           # ... and the joint positions found for it,
    cdef double[::1] _seed               # coming from these;
    cdef double[::1] _q                  # and joint positions whose branch was asked for last,
    cdef double[::1] _distances          # with how far they are from others
    cdef int _branch(self, q) except? -1
