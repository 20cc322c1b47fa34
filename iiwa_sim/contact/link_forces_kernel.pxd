# For the kernels of links that have such forces.
from iiwa_sim.contact.link_friction_kernel cimport LinkFriction

cdef class LinkForces(LinkFriction):
    cdef Py_ssize_t _own_count         # links of the arm
    cdef object _names
    cdef dict _numbers                 # of these
    cdef double[:, ::1] _depth         # how deep (m) each link pressed when it was looked at last
    cdef double[:, ::1] _pushing       # force (N) on a link of a robot that yields, on the average
    # Of each capsule and surface: which way is out in the frame of that; zeros where they are apart.
    cdef double[:, :, ::1] _came
    cdef void _recall(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef void _remember(self, Py_ssize_t c, Py_ssize_t s, double gap, double part) noexcept
    cdef object _press(
        self, Py_ssize_t c, Py_ssize_t s, double part, double depth, object speeds, double tick_s,
        object torques, object pushing, object worn
    )
