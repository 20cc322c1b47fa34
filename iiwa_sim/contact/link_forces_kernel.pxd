# For the kernels of links that have such forces.
from iiwa_sim.contact.link_friction_kernel cimport LinkFriction

cdef class LinkForces(LinkFriction):
    cdef Py_ssize_t _own_count         # links of the arm
    cdef int[::1] _feels
    cdef object _names
    cdef dict _numbers                 # of these
    cdef Py_ssize_t _part_count
    cdef long begun                    # how often something worn has begun to feel parts
    cdef char[:, ::1] _deaf            # of each capsule and surface: it does not feel that until it is out of it
    cdef double[:, ::1] _depth         # how deep (m) each link pressed when it was looked at last
    cdef double[:, ::1] _unpressed     # how deep (m) it was in there without pressing
    cdef double[:, ::1] _pushing       # force (N) on a link of a robot that yields, on the average
    # Of each capsule and surface: which way is out in the frame of that; zeros where they are apart.
    cdef double[:, :, ::1] _came
    cdef bint _is_part(self, Py_ssize_t s) noexcept
    cdef bint _can_feel(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef bint _feels_now(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef void _recall(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef void _remember(self, Py_ssize_t c, Py_ssize_t s, double gap, double part) noexcept
    cdef object _press(
        self, Py_ssize_t c, Py_ssize_t s, double part, double depth, object speeds, double tick_s,
        object torques, object pushing, object worn
    )
