# For kernels that read and write what bounds a clock.
cdef class Bounds:
    cdef readonly double[:, ::1] a1
    cdef readonly double[:, ::1] a2
    cdef readonly double[::1] cap
    cdef readonly double[:, ::1] j1
    cdef readonly double[:, ::1] j2
    cdef readonly double[:, ::1] j3
    cdef readonly Py_ssize_t[:, ::1] counts
    cdef readonly Py_ssize_t cells

cdef class Rows:
    cdef readonly Bounds bounds
    cdef readonly double[:, :, ::1] inner
    cdef readonly double[:, :, ::1] peaks
    cdef readonly Py_ssize_t[::1] starts
    cdef readonly double[::1] parts
    cdef readonly double[:, :, ::1] per_limit
    cdef readonly double[:, ::1] tight
    cdef public double[:, ::1] cuts
