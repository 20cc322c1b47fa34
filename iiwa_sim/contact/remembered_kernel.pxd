# For the kernels that have parts meet.
cdef class Remembered:
    cdef Py_ssize_t _table
    cdef Py_ssize_t _used
    cdef long long[::1] _keys
    cdef double[:, ::1] _memory
    cdef Py_ssize_t _find(self, long long key) noexcept
    cdef bint _has_come_in(self, long long key) noexcept
    cdef void _forget_place(self, long long key) noexcept
    cdef object _sift(self)
    cdef Py_ssize_t _room_for(self, long long key) except *
