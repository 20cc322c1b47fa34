# For the kernels of links that have such friction.
from iiwa_sim.contact.capsules_kernel cimport Capsules

cdef class LinkFriction(Capsules):
    cdef readonly object contacts      # tuple of `LinkContact`
    cdef Py_ssize_t[::1] _link         # of each capsule: the number of its link
    cdef double[::1] _share
    cdef double[:, ::1] _law           # of each surface: stiffness, damping, friction
    # Of each link and surface: whether they touched, and how far friction's spring is wound (m, in the base).
    cdef char[:, ::1] _touches
    cdef double[:, :, ::1] _rubbed
    cdef double[:, :, ::1] _dragging   # friction (N) on a link of a robot that yields, on the average
    cdef object _rub(
        self, Py_ssize_t c, Py_ssize_t s, double wx, double wy, double wz, double normal_n
    )
    cdef (double, double, double) _drag(
        self, Py_ssize_t c, Py_ssize_t s, (double, double, double) place, (double, double, double) gone,
        double tick_s, double push_n
    )
    cdef (double, double, double) _gone(
        self, Py_ssize_t c, double x, double y, double z, object speeds, double tick_s
    )
