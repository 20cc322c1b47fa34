# For other kernels that move a TCP or solve for joint positions.
cdef class Tcp:
    cdef readonly object tool_in_flange
    cdef readonly Py_ssize_t joint_count
    cdef readonly object fixed         # poses between joints (n + 1, 12)
    cdef double[:, ::1] _fixed
    cdef double[::1] _q
    cdef double[::1] turned            # rotation of the TCP in the base, row by row
    cdef double[::1] place             # its translation (m)
    cdef double[:, ::1] sides          # directions of x of each joint's frame in the base, and of z,
    cdef double[:, ::1] axes
    cdef double[:, ::1] points         # and its origin (m)
    cdef double[:, ::1] columns        # its Jacobian (6, n), after `find_columns`
    cdef double[::1] torque            # on each joint (Nm), after `find_torques`
    cdef object _columns_array
    cdef object _pose
    cdef bint _has_columns
    cdef bint go_to(self, object joints) except? -1
    cdef object find_torques(self, object joints, object wrench)
    cdef void find_columns(self) noexcept

cpdef object carried_wrench(object now, tuple motion, double tick_s, double[:, :] moments)

cdef class Kinematics:
    cdef readonly Tcp arm                 # the TCP by itself
    cdef readonly Py_ssize_t joint_count
    cdef readonly Py_ssize_t coordinates  # six of the TCP, and the redundancy
    cdef object _inverse
    cdef double[::1] _to_flange           # pose of the flange in the TCP
    cdef bint _beyond_half_turn
    cdef int _kind
    cdef double[::1] _numbers
    cdef double[:, ::1] _pose             # scratch: pose of the flange (1, 12) and its joint positions
    cdef double[:, ::1] _joints           # (1, n), which continue
    cdef double[::1] _seed                # these
    cdef double[::1] _distances
    cdef object _last
    cdef double[::1] _redundancy          # (1,)
    cdef long long[::1] _branch           # (1,)
    cdef long long[::1] _result           # (1,)
    cdef object joints_for(
        self, double[::1] turned, double x, double y, double z, double redundancy, object present
    )
