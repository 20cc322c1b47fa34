# For kernels that feel, and that are felt.
cdef class Feeling:
    cdef public double fx
    cdef public double fy
    cdef public double fz
    cdef public double tx
    cdef public double ty
    cdef public double tz
    cpdef bint feel_at(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember
    ) except? -1
    cdef bint acts_at(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember,
        double[::1] acting
    ) except? -1

cdef class Reached:
    cdef double[::1] at                # the rotation of the TCP in the base, row by row, and its place (m)
    cdef bint felt                     # whether it is known what surfaces do there,
    cdef double[::1] acting            # force (N) and torque (Nm) about the TCP, along the axes of the base
