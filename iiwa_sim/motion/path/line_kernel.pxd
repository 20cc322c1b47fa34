from iiwa_sim.motion.path.tcp_line_kernel cimport TcpLine

cdef class LineJoints:
    cdef readonly object inverse
    cdef readonly object line
    cdef readonly object start
    cdef TcpLine _line
    cdef double _redundancy              # at the start (rad)
    cdef double _way                     # of it along the line (rad)
    cdef Py_ssize_t _count               # of joints
    cdef int _kind
    cdef double[::1] _numbers
    cdef double[:, ::1] _poses           # scratch: poses of the flange ...
    cdef double[:, ::1] _joints          # ... and the joint positions found for them,
    cdef double[::1] _seed               # following these
    cdef double[::1] _reference
    cdef int _place(self, Py_ssize_t row, double s, int status, double aligned) noexcept
    cdef _follow(self, seed)
    cdef double _end_of_reach(self, double near, double far, int status) noexcept
    cdef double _off_even_way(self, coming, going, double part) except? -1.0
    cdef Py_ssize_t _fit(
        self, double low, double high, int status, bint near, double[::1] nodes, double[:, ::1] weights,
        double[:, ::1] coefficients
    ) except? -2
