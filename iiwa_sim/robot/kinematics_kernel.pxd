# For kernels that move a TCP.
from iiwa_sim.robot.tcp_kernel cimport Tcp

cdef class Kinematics:
    cdef readonly Tcp arm                 # the TCP by itself
    cdef readonly Py_ssize_t joint_count
    cdef readonly Py_ssize_t coordinates  # six of the TCP, and one more where there is redundancy
    cdef object _inverse
    cdef double[::1] _turned
    cdef double[::1] _to_flange
    cdef bint _beyond_half_turn
    cdef object _redundancy_row
    cdef double[::1] _share               # of each joint in the redundancy
    cdef int _kind
    cdef double[::1] _numbers
    cdef double[:, ::1] _room
    cdef object _last
    cdef int _status
    cdef double redundancy_where_it_is(self) noexcept  # of the joint positions the arm has gone to
    cdef object joints_for(
        self, double[::1] turned, double x, double y, double z, double redundancy, object present
    )
