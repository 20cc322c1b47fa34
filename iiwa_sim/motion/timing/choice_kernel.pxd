# For rows as they are written.
cdef Py_ssize_t chosen(double[:, ::1] first, double[:, ::1] second, double[:, ::1] third, Py_ssize_t k, Py_ssize_t n,
                       int orders, double[:, ::1] scratch) noexcept
