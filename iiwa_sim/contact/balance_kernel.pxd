# For the kernels of a crowd.
from iiwa_sim.contact.places_kernel cimport Places

cdef class Balance(Places):
    cdef double _tick
    cdef double _limit                 # of friction at each point below the part that is looked at (N)
    cdef double[:, ::1] _velocity      # of each part
    cdef double[:, ::1] _wound
    cdef double[::1] _deep             # how deep what of the arm presses on it is in it (m)
    cdef double[:, ::1] _points        # four below each, from its middle (m)
    cdef double[:, ::1] _mass          # m, m, m, I with what it carries
    cdef double[:, ::1] _below         # stiffness, depth and weight with what it carries, its own depth
    cdef Py_ssize_t _many              # parts that may move, and which these are
    cdef Py_ssize_t[::1] _group
    cdef double[:, ::1] _d             # their ways
    cdef Py_ssize_t[::1] _first        # where the places of each begin
    cdef Py_ssize_t[::1] _mine         # and which of `_of` these are
    cdef Py_ssize_t _awake             # parts that do not just go with what carries them
    cdef char[::1] _open               # whether the way of each is still to be found
    cdef double[:, ::1] _h             # second derivatives
    cdef double[::1] _b                # first ones
    cdef double[::1] _s                # the next step
    cdef object _balance(self)
    cdef void _wake(self, Py_ssize_t k) noexcept
    cdef double _better(self, Py_ssize_t k) noexcept
    cdef double _value(self, Py_ssize_t k, bint derive) noexcept
    cdef void _solve(self) noexcept
