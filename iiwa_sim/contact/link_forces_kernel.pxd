# For the kernels of links that have such forces.
from iiwa_sim.contact.capsules_kernel cimport Capsules

cdef class LinkForces(Capsules):
    cdef readonly object contacts      # tuple of `LinkContact`
    cdef Py_ssize_t _own_count         # links of the arm
    cdef Py_ssize_t[::1] _link         # of each capsule: the number of its link
    cdef int[::1] _feels
    cdef double[::1] _share
    cdef object _names
    cdef Py_ssize_t _part_count
    cdef double[:, ::1] _law           # of each surface: stiffness, damping, friction
    cdef double[:, ::1] _pushing       # force (N) on a link of a robot that yields, on the average
    # Of each link and surface: whether they touched, and how far friction's spring is wound (m, in the base).
    cdef char[:, ::1] _touches
    cdef double[:, :, ::1] _rubbed
    cdef double[:, :, ::1] _dragging   # friction (N) on a link of a robot that yields, on the average
    # Of each part: how it has been moved since links have felt it: a way (m), an angle about z (rad).
    cdef double[:, ::1] _shifted
    # Of each capsule and surface: which way is out in the frame of that; zeros where they are apart.
    cdef double[:, :, ::1] _came
    cdef bint _is_part(self, Py_ssize_t s) noexcept
    cdef bint _can_feel(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef void _recall(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef void _remember(self, Py_ssize_t c, Py_ssize_t s, double gap, double part) noexcept
    cdef object _press(
        self, Py_ssize_t c, Py_ssize_t s, double part, double depth, object speeds, double tick_s,
        object torques, object pushing, object worn
    )
    cdef object _rub(
        self, Py_ssize_t c, Py_ssize_t s, double wx, double wy, double wz, double normal_n
    )
    cdef (double, double, double) _drag(
        self, Py_ssize_t c, Py_ssize_t s, (double, double, double) place, (double, double, double) gone,
        double tick_s, double push_n
    )
    cdef (double, double, double) _gone(
        self, Py_ssize_t c, Py_ssize_t s, double x, double y, double z, object speeds, double tick_s
    )
