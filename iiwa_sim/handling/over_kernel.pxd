# For the kernel of what touches a part.
cdef class Over:
    cdef double[:, ::1] _own           # the places of points, in the part (m)
    cdef double[::1] _row              # the part as a shape
    cdef int _kind
    cdef bint _is_level
    cdef bint _is_near                 # whether it may press on the face that is asked for
    cdef bint _is_apart                # and whether it surely does not
    cdef double[::1] _under            # its footprint, and that of this face
    cdef double[::1] _face
    cdef double x                      # where the point that was asked for last presses
    cdef double y
    cdef bint put(self, double[::1] pose) except? -1
    cdef double gap(self, double[::1] row, int kind) except? -1.0
    cdef void face(self, double[::1] row, int kind) except *
    cdef bint is_apart(self) noexcept
    cdef bint is_over(self, Py_ssize_t n) noexcept
    cdef bint is_low(self, Py_ssize_t n) noexcept
    cdef bint is_above(self, Py_ssize_t n) noexcept
    cdef double height(self, Py_ssize_t n) noexcept
    cdef double least_gap(self, double[::1] pose, double[:, ::1] shapes, int[::1] kinds) except? -1.0

cdef bint footprint(double[::1] row, int kind, double[::1] found, double side) noexcept
cdef double beside(double[::1] under, double[::1] face) noexcept
cdef double along(double[::1] face, double cx, double cy) noexcept
cdef (bint, double, double) over(double[::1] under, double[::1] face, double x, double y) noexcept
cdef (double, double) into(double[::1] face, double inset, double x, double y) noexcept
