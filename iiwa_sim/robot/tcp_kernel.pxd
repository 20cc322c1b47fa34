# For kernels that have a TCP: `go_to`, then what lies in the arrays.
cdef class Tcp:
    cdef readonly object tool_in_flange
    cdef readonly Py_ssize_t joint_count
    cdef readonly object fixed         # for kernels that have no object: (n + 1, 12)
    cdef double[:, ::1] _fixed
    cdef double[::1] _to_flange        # pose of the flange in the TCP
    cdef double[::1] _q
    cdef double[:, ::1] _sines         # of these, and their cosines
    cdef double[::1] turned            # rotation of the TCP in the base, row by row
    cdef double[::1] place             # its translation (m)
    cdef double[:, ::1] _axes
    cdef double[:, ::1] _points
    cdef double[:, ::1] columns        # its Jacobian (6, n), after `find_columns`
    cdef double[::1] torque            # on each joint (Nm), after `find_torques`
    cdef object _columns_array
    cdef object _pose
    cdef bint _has_columns
    cdef bint go_to(self, object joints) except? -1
    cdef object find_torques(self, object joints, object wrench)
    cdef void find_columns(self) noexcept
