# For kernels that have a path.
cdef class Polynomial:
    cdef readonly object borders
    cdef readonly object offsets
    cdef readonly object coefficients
    cdef readonly object start
    cdef readonly object end
    cdef readonly object tcp_length_m
    cdef double[::1] _borders
    cdef Py_ssize_t[::1] _offsets
    cdef double[:, ::1] _coefficients
    cdef double[:, :, ::1] _room
