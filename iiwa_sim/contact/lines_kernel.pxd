# For kernels that have lines meet shapes.
cdef (double, double) nearest_along(
    int kind, double a, double b, double c, double radius, double x, double y, double z,
    double dx, double dy, double dz, double mx, double my, double mz
) noexcept
cdef double _at(
    int kind, double a, double b, double c, double radius, double x, double y, double z,
    double dx, double dy, double dz, double mx, double my, double mz, double part
) noexcept
