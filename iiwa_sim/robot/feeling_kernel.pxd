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
